#include "lpss/bullet/manifold_codec.h"

#include <cstdint>

#include "lpss/base/bytes.h"

namespace tessera::bullet {
namespace {

// In every field that the solver, or the next detection, reads.
template <typename Point, typename Visit>
void visit_fields(Point& p, const Visit& visit) {
  for (auto* v : {&p.m_localPointA, &p.m_localPointB, &p.m_positionWorldOnA, &p.m_positionWorldOnB,
                  &p.m_normalWorldOnB, &p.m_lateralFrictionDir1, &p.m_lateralFrictionDir2}) {
    for (int i = 0; i < 3; ++i) visit((*v)[i]);
  }
  for (auto* s : {&p.m_distance1, &p.m_combinedFriction, &p.m_combinedRollingFriction,
                  &p.m_combinedSpinningFriction, &p.m_combinedRestitution, &p.m_appliedImpulse, &p.m_prevRHS,
                  &p.m_appliedImpulseLateral1, &p.m_appliedImpulseLateral2, &p.m_contactMotion1,
                  &p.m_contactMotion2, &p.m_contactCFM, &p.m_contactERP, &p.m_frictionCFM}) {
    visit(*s);
  }
  for (auto* n :
       {&p.m_partId0, &p.m_partId1, &p.m_index0, &p.m_index1, &p.m_contactPointFlags, &p.m_lifeTime}) {
    visit(*n);
  }
}

constexpr std::uint8_t kPredictive = 1;
constexpr std::uint8_t kSwapped = 2;

btManifoldPoint blank_point() { return {btVector3(0, 0, 0), btVector3(0, 0, 0), btVector3(0, 0, 0), 0}; }

}  // namespace

std::string encode_manifolds(const std::vector<ManifoldRecord>& manifolds) {
  std::string bytes;
  const ByteWriter write(bytes);
  write(static_cast<std::uint8_t>(sizeof(btScalar)));
  for (const ManifoldRecord& m : manifolds) {
    write(static_cast<std::uint8_t>((m.is_predictive ? kPredictive : 0) | (m.is_swapped ? kSwapped : 0)));
    write(static_cast<std::uint8_t>(m.points.size()));
    write(static_cast<std::int32_t>(m.children.first));
    write(static_cast<std::int32_t>(m.children.second));
    for (const btManifoldPoint& point : m.points) visit_fields(point, write);
  }
  return bytes;
}

bool decode_manifolds(std::string_view bytes, std::vector<ManifoldRecord>& manifolds) {
  manifolds.clear();
  const ByteReader read(bytes);
  if (read.get<std::uint8_t>() != sizeof(btScalar)) return false;
  while (!read.at_end()) {
    ManifoldRecord m;
    const auto flags = read.get<std::uint8_t>();
    m.is_predictive = (flags & kPredictive) != 0;
    m.is_swapped = (flags & kSwapped) != 0;
    const auto count = read.get<std::uint8_t>();
    if (count > MANIFOLD_CACHE_SIZE) return false;
    m.children.first = read.get<std::int32_t>();
    m.children.second = read.get<std::int32_t>();
    for (int i = 0; i < count; ++i) {
      m.points.push_back(blank_point());
      visit_fields(m.points.back(), read);
    }
    if (read.is_short()) return false;
    manifolds.push_back(std::move(m));
  }
  return true;
}

}  // namespace tessera::bullet
