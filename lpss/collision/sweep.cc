#include "lpss/collision/sweep.h"

#include <algorithm>

#include "lpss/collision/closest.h"

namespace tessera::collision {
namespace {

constexpr int kStepsMax = 64;
// m: what is closer touches, and still has a direction.
constexpr double kClose = 1e-7;

// How much closer (m) two that touch at the start may come by the metre, and still slide: rounding of what
// stands level.
constexpr double kSlides = 1e-6;

}  // namespace

std::optional<SweepContact> sweep(const Core<double>& a, const Core<double>& b,
                                  const Placement<double>& start, const SweepWay& way) {
  Placement<double> now = start;
  Vector3<double> before = Vector3<double>::Zero();
  double gone = 0;
  for (int step = 0; step < kStepsMax; ++step) {
    now.offset = start.offset - way.direction * gone;
    const std::optional<Closest<double>> found =
        search_closest<double>(a, b, now, way.length - gone + kClose, before);
    if (!found) return std::nullopt;
    const double approach = -way.direction.dot(found->normal);
    if (step == 0 && found->gap < -kSweepTouching) return SweepContact{0, found->normal};
    if (step == 0 && found->gap <= kClose && approach <= kSlides) return std::nullopt;
    if (found->gap <= kClose) {
      const double rest = approach > 0 ? std::max(0.0, found->gap) / approach : 0;
      return SweepContact{std::min(gone + rest, way.length), found->normal};
    }
    if (!(approach > 0)) return std::nullopt;
    before = found->normal;
    const double next = gone + (found->gap - kClose / 2) / approach;
    if (next > way.length) return std::nullopt;
    gone = next;
  }
  // It grazes: all that is known is that it gets so far.
  return SweepContact{gone, before};
}

std::optional<SweepContact> sweep_at_plane(double gap, const Vector3<double>& normal, const SweepWay& way) {
  const double approach = -way.direction.dot(normal);
  if (gap < -kSweepTouching) return SweepContact{0, normal};
  if (!(approach > 0) || (gap <= kClose && approach <= kSlides)) return std::nullopt;
  const double distance = std::max(0.0, gap) / approach;
  if (distance > way.length) return std::nullopt;
  return SweepContact{distance, normal};
}

}  // namespace tessera::collision
