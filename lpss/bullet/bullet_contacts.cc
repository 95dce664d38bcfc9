// Contacts, and their transfer between worlds.

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <limits>
#include <tuple>

#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/manifold_codec.h"

namespace tessera::bullet {
namespace {

// A manifold with the bodies of its pair in the order of their ids.
struct Entry {
  btPersistentManifold* manifold;
  Body* a;
  Body* b;

  auto key() const { return std::tuple(a->id, b->id, is_predictive(*manifold), child_pair(*manifold)); }
};

Entry entry_of(btPersistentManifold* manifold) {
  Body* a = &Body::of(manifold->getBody0());
  Body* b = &Body::of(manifold->getBody1());
  if (b->id < a->id) std::swap(a, b);
  return {manifold, a, b};
}

bool boxes_overlap(const Body& a, const Body& b) {
  const Bounds p = CollisionSpace::bounds_of(a);
  const Bounds q = CollisionSpace::bounds_of(b);
  return TestAabbAgainstAabb2(p.low, p.high, q.low, q.high);
}

bool is_touching(const btPersistentManifold& manifold) {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    if (point.getDistance() <= 0 || point.getAppliedImpulse() > 0) return true;
  }
  return false;
}

void put_points(btPersistentManifold& manifold, const std::vector<btManifoldPoint>& points) {
  for (const btManifoldPoint& point : points) manifold.addManifoldPoint(point, /*isPredictive=*/true);
}

}  // namespace

std::span<const ContactPair> BulletWorld::contacts() {
  if (!is_gathered_) gather();
  return pairs_;
}

void BulletWorld::gather() {
  std::vector<Entry> entries;
  const int count = space_ ? space_->dispatcher().getNumManifolds() : 0;
  for (int i = 0; i < count; ++i) {
    btPersistentManifold* manifold = space_->dispatcher().getManifoldByIndexInternal(i);
    if (manifold->getNumContacts() == 0) continue;
    const Entry entry = entry_of(manifold);
    // What both had slept apart from would be forgotten at the next detection, wherever that is.
    if (!entry.a->is_awake() && !entry.b->is_awake() && !boxes_overlap(*entry.a, *entry.b)) continue;
    entries.push_back(entry);
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& x, const Entry& y) { return x.key() < y.key(); });

  pairs_.clear();
  ranges_.clear();
  manifolds_.clear();
  for (const Entry& entry : entries) {
    if (pairs_.empty() || pairs_.back().a != entry.a->id || pairs_.back().b != entry.b->id) {
      pairs_.push_back({entry.a->id, entry.b->id, entry.a->slot, entry.b->slot, false});
      ranges_.push_back({manifolds_.size(), 0});
    }
    pairs_.back().touching = pairs_.back().touching || is_touching(*entry.manifold);
    ++ranges_.back().count;
    manifolds_.push_back(entry.manifold);
  }
  is_gathered_ = true;
}

std::span<btPersistentManifold* const> BulletWorld::manifolds_of(std::size_t pair) const {
  return std::span(manifolds_).subspan(ranges_[pair].first, ranges_[pair].count);
}

// Points of a manifold have a normal each, which differ little: that of the last one is taken.
std::vector<ContactDetail> BulletWorld::touching_patches(std::size_t pair) const {
  const Body& b = body(pairs_[pair].slot_b);
  std::vector<ContactDetail> details;
  for (const btPersistentManifold* manifold : manifolds_of(pair)) {
    if (!is_touching(*manifold)) continue;
    const bool is_swapped = &Body::of(manifold->getBody0()) == &b;
    const double on_a = is_swapped ? -1 : 1;
    ContactDetail& detail = details.emplace_back();
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold->getContactPoint(i);
      // By the local point: the point in the sector's frame belongs to another sector while an imported pair
      // sleeps.
      const btVector3& local = is_swapped ? point.m_localPointA : point.m_localPointB;
      detail.points.push_back(
          {to_eigen(b.rigid.getWorldTransform() * local), -point.getDistance(), point.getAppliedImpulse()});
      detail.impulse += point.getAppliedImpulse();
      detail.normal = to_eigen(point.m_normalWorldOnB) * on_a;
      detail.friction += (to_eigen(point.m_lateralFrictionDir1) * double(point.m_appliedImpulseLateral1) +
                          to_eigen(point.m_lateralFrictionDir2) * double(point.m_appliedImpulseLateral2)) *
                         on_a;
    }
  }
  return details;
}

ManifoldState BulletWorld::export_manifold(std::size_t pair) const {
  std::vector<ManifoldRecord> records;
  for (btPersistentManifold* manifold : manifolds_of(pair)) {
    ManifoldRecord record;
    record.children = child_pair(*manifold);
    record.is_predictive = is_predictive(*manifold);
    record.is_swapped = Body::of(manifold->getBody0()).id != pairs_[pair].a;
    for (int i = 0; i < manifold->getNumContacts(); ++i)
      record.points.push_back(manifold->getContactPoint(i));
    records.push_back(std::move(record));
  }
  return {pairs_[pair].a, pairs_[pair].b, encode_manifolds(records)};
}

bool BulletWorld::is_wanted(const Body& a, const Body& b) const {
  return is_wanted_pair(a, b) && !engine_.are_apart(a.id, b.id);
}

void BulletWorld::import_manifold(const ManifoldState& state) {
  const auto slot_a = slots_.find(state.a.value);
  const auto slot_b = slots_.find(state.b.value);
  std::vector<ManifoldRecord> records;
  require(decode_manifolds(state.points, records),
          "contact points must come from an engine of the same precision");
  if (slot_a == slots_.end() || slot_b == slots_.end()) return;
  Body& a = body(slot_a->second);
  Body& b = body(slot_b->second);
  if (!is_wanted(a, b)) return;
  CollisionSpace::Dispatcher& dispatcher = space_->dispatcher();
  const btDispatcherInfo& info = space_->world().getDispatchInfo();
  btBroadphasePair& pair = space_->pair_of(a, b);

  const btCollisionObjectWrapper first(nullptr, a.rigid.getCollisionShape(), &a.rigid,
                                       a.rigid.getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper second(nullptr, b.rigid.getCollisionShape(), &b.rigid,
                                        b.rigid.getWorldTransform(), -1, -1);
  dispatcher.is_importing = true;
  if (!pair.m_algorithm) {
    // Only a detection creates all manifolds; its points are then replaced.
    pair.m_algorithm = dispatcher.findAlgorithm(&first, &second, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    btManifoldResult result(&first, &second);
    pair.m_algorithm->processCollision(&first, &second, info, &result);
  }
  btManifoldArray manifolds;
  pair.m_algorithm->getAllContactManifolds(manifolds);
  for (int i = 0; i < manifolds.size(); ++i) manifolds[i]->clearManifold();
  const bool is_compound =
      a.rigid.getCollisionShape()->isCompound() || b.rigid.getCollisionShape()->isCompound();
  for (const ManifoldRecord& record : records) {
    if (record.is_predictive) continue;  // recreated by every detection
    btPersistentManifold* manifold = nullptr;
    if (is_compound) {
      manifold = static_cast<CompoundAlgorithm*>(pair.m_algorithm)
                     ->manifold_of(record.children, &first, &second, info);
    } else if (manifolds.size() > 0) {
      manifold = manifolds[0];
    }
    if (!manifold) continue;
    manifold->clearManifold();
    put_points(*manifold, record.points);
  }
  dispatcher.is_importing = false;
  is_gathered_ = false;
}

// By policy clone, every sector solves what it has.
void BulletWorld::append_numbers(BodySlot, std::string&) const {
  require(false, "islands of Bullet's own worlds are not solved elsewhere");
}
void BulletWorld::append_pair_numbers(std::size_t, std::string&) const {
  require(false, "islands of Bullet's own worlds are not solved elsewhere");
}

void BulletWorld::release(std::vector<btPersistentManifold*>& manifolds) {
  for (btPersistentManifold* manifold : manifolds) space_->dispatcher().releaseManifold(manifold);
  manifolds.clear();
}

void BulletWorld::release_of(const Body& gone, std::vector<btPersistentManifold*>& manifolds) {
  std::erase_if(manifolds, [&](btPersistentManifold* manifold) {
    if (manifold->getBody0() != &gone.rigid && manifold->getBody1() != &gone.rigid) return false;
    space_->dispatcher().releaseManifold(manifold);
    return true;
  });
}

}  // namespace tessera::bullet
