#include "lpss/collision/closest.h"

#include <cmath>
#include <limits>

#include "lpss/collision/axial.h"
#include "lpss/collision/polytope.h"
#include "lpss/collision/simplex.h"

namespace tessera::collision {
namespace {

constexpr int kPassesMax = 48;
// Of the square of the distance: the closest point is known well enough.
template <typename Scalar>
constexpr Scalar kKnownWell = Scalar(sizeof(Scalar) == sizeof(float) ? 1e-6 : 1e-10);
// Of the extent of the difference: points that are closer to the origin tell no direction.
template <typename Scalar>
constexpr Scalar kNowhere = Scalar(64) * std::numeric_limits<Scalar>::epsilon();

enum class Found { kApart, kClose, kOverlap };

template <typename Scalar>
class Search {
 public:
  using Vector = Vector3<Scalar>;

  Search(const PlacedCore<Scalar>& a, const PlacedCore<Scalar>& b, Scalar reach)
      : a_(a), b_(b), difference_(a, b), reach_(reach) {}

  Found run(const Vector& first) {
    Vector seen = first;  // the direction from b to a
    Scalar square = std::numeric_limits<Scalar>::max();
    Scalar extent = 0;
    for (int pass = 0; pass < kPassesMax; ++pass) {
      const DifferencePoint<Scalar> point = difference_.support(Vector(-seen));
      const Scalar along = seen.dot(point.at);
      if (along > 0 && are_apart(seen, along)) return Found::kApart;
      if (pass > 0 && (square - along <= kKnownWell<Scalar> * square || is_known(point.at))) break;
      extent = std::max(extent, point.at.cwiseAbs().maxCoeff());
      simplex_.add(point);
      const ClosestOfSimplex<Scalar> nearest = simplex_.closest(/*may_hold_origin=*/!(along > 0));
      if (nearest.count == 0) return Found::kOverlap;
      const Scalar nearer = nearest.at.squaredNorm();
      if (pass > 0 && !(nearer < square)) {
        // No nearer, by rounding.
        --simplex_.count;
        break;
      }
      simplex_.keep(nearest);
      seen = nearest.at;
      square = nearer;
      if (!(square > kNowhere<Scalar> * kNowhere<Scalar> * extent * extent)) return Found::kOverlap;
    }
    seen_ = seen;
    return Found::kClose;
  }

  // Of cores that are apart.
  Closest<Scalar> nearest() const {
    const Scalar distance = seen_.norm();
    return around({seen_ / distance, simplex_.on_a(), simplex_.on_b(), distance});
  }

  Closest<Scalar> deepest() const {
    const Penetration<Scalar> found = Polytope<Scalar>(difference_).find(simplex_);
    return around({-found.out, found.on_a, found.on_b, -found.depth});
  }

 private:
  // As seen along a direction. `along`: from one core to the other, by the length of the direction.
  bool are_apart(const Vector& direction, Scalar along) const {
    const Scalar length = direction.norm();
    const Scalar least = a_.margin() + b_.margin() + reach_;
    if (along <= least * length) return false;
    const Vector unit = direction / length;
    return along / length > least + a_.rounded_off_at_most(Vector(-unit)) + b_.rounded_off_at_most(unit);
  }

  bool is_known(const Vector& at) const {
    for (int n = 0; n < simplex_.count; ++n) {
      if (simplex_.point[n].at == at) return true;
    }
    return false;
  }

  // From cores to their shapes.
  Closest<Scalar> around(const Closest<Scalar>& cores) const {
    const Scalar of_a = a_.margin() + a_.rounded_off(Vector(-cores.normal));
    const Scalar of_b = b_.margin() + b_.rounded_off(cores.normal);
    return {cores.normal, cores.on_a - cores.normal * of_a, cores.on_b + cores.normal * of_b,
            cores.gap - of_a - of_b};
  }

  const PlacedCore<Scalar>& a_;
  const PlacedCore<Scalar>& b_;
  Difference<Scalar> difference_;
  Scalar reach_;
  Simplex<Scalar> simplex_;
  Vector seen_ = Vector::Zero();
};

}  // namespace

template <typename Scalar>
std::optional<Closest<Scalar>> closest(const Core<Scalar>& a, const Core<Scalar>& b,
                                       const Placement<Scalar>& placement, std::type_identity_t<Scalar> reach,
                                       const Vector3<Scalar>& before) {
  Closest<Scalar> known;
  const AxialCase axial = closest_axial<Scalar>(a, b, placement, reach, before, known);
  if (axial == AxialCase::kApart) return std::nullopt;
  if (axial == AxialCase::kFound) return known;
  return search_closest<Scalar>(a, b, placement, reach, before);
}

template <typename Scalar>
std::optional<Closest<Scalar>> search_closest(const Core<Scalar>& a, const Core<Scalar>& b,
                                              const Placement<Scalar>& placement,
                                              std::type_identity_t<Scalar> reach,
                                              const Vector3<Scalar>& before) {
  const PlacedCore<Scalar> placed_a(a, placement.a, Vector3<Scalar>::Zero());
  const PlacedCore<Scalar> placed_b(b, placement.b, placement.offset);
  Search<Scalar> search(placed_a, placed_b, reach);
  Vector3<Scalar> first = before;
  if (first.isZero(0)) first = placement.a * a.middle - placement.b * b.middle - placement.offset;
  if (first.isZero(0)) first = Vector3<Scalar>::UnitZ();
  const Found found = search.run(first);
  if (found == Found::kApart) return std::nullopt;
  const Closest<Scalar> closest = found == Found::kOverlap ? search.deepest() : search.nearest();
  if (!(closest.gap <= reach)) return std::nullopt;
  return closest;
}

template std::optional<Closest<float>> closest(const Core<float>&, const Core<float>&,
                                               const Placement<float>&, float, const Vector3<float>&);
template std::optional<Closest<double>> closest(const Core<double>&, const Core<double>&,
                                                const Placement<double>&, double, const Vector3<double>&);
template std::optional<Closest<double>> search_closest(const Core<double>&, const Core<double>&,
                                                       const Placement<double>&, double,
                                                       const Vector3<double>&);

}  // namespace tessera::collision
