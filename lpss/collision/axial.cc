#include "lpss/collision/axial.h"

#include <algorithm>
#include <cmath>

#include "lpss/collision/hull.h"

namespace tessera::collision {
namespace {

// Axes whose angle has a smaller sine lie along each other, and caps so are level.
constexpr double kLevelSine = 0.01;

template <typename Scalar>
bool is_axial(const Core<Scalar>& core) {
  using Kind = typename Core<Scalar>::Kind;
  return core.kind == Kind::kPoint || core.kind == Kind::kSegment || core.kind == Kind::kCylinder;
}

template <typename Scalar>
class AxialPair {
 public:
  using Vector = Vector3<Scalar>;
  using Kind = typename Core<Scalar>::Kind;

  AxialPair(const Core<Scalar>& a, const Core<Scalar>& b, const Placement<Scalar>& placement, Scalar reach)
      : a_(a),
        b_(b),
        placement_(placement),
        reach_(reach),
        axis_a_(placement.a.col(2)),
        axis_b_(placement.b.col(2)),
        deepest_((is_flat(a) ? a.margin : Scalar(0)) + (is_flat(b) ? b.margin : Scalar(0))) {}

  // Between axes: no shape is farther from its axis than its radius.
  AxialCase look_at_sides(Closest<Scalar>& found) {
    const Scalar radius_a = radius_of(a_);
    const Scalar radius_b = radius_of(b_);
    const Scalar length_a = 2 * a_.half.z();
    const Scalar length_b = 2 * b_.half.z();
    const Vector low_a = -a_.half.z() * axis_a_;
    const Vector low_b = placement_.offset - b_.half.z() * axis_b_;
    // Of two segments, the first one may be a point.
    const bool is_first = length_b > 0;
    const ClosestSegments<Scalar> axes =
        is_first ? ClosestSegments<Scalar>(low_a, length_a * axis_a_, low_b, length_b * axis_b_)
                 : ClosestSegments<Scalar>(low_b, length_b * axis_b_, low_a, length_a * axis_a_);
    const Scalar place_a = is_first ? axes.s : axes.t;
    const Scalar place_b = is_first ? axes.t : axes.s;
    Vector on_a = is_first ? axes.on_a : axes.on_b;
    Vector away = on_a - (is_first ? axes.on_b : axes.on_a);
    Scalar distance = away.norm();
    if (distance - radius_a - radius_b > reach_) return AxialCase::kApart;
    if (distance > 0) between_axes_ = away / distance;
    if (!is_beside(a_, place_a) || !is_beside(b_, place_b)) {
      if (!lie_along(on_a, away)) return AxialCase::kUnknown;
      distance = away.norm();
    }
    const Scalar gap = distance - radius_a - radius_b;
    if (!(gap >= -deepest_)) return AxialCase::kUnknown;
    if (gap > reach_) return AxialCase::kApart;
    found.normal = away / distance;
    found.on_a = on_a - radius_a * found.normal;
    found.on_b = found.on_a - gap * found.normal;
    found.gap = gap;
    return AxialCase::kFound;
  }

  // The cap of one, `by_a`, that looks at the other. Its normal points out of it.
  AxialCase look_at_cap(bool by_a, Closest<Scalar>& found) const {
    const Core<Scalar>& flat = by_a ? a_ : b_;
    const Core<Scalar>& other = by_a ? b_ : a_;
    const Vector& axis = by_a ? axis_a_ : axis_b_;
    const Vector middle = by_a ? Vector(Vector::Zero()) : placement_.offset;
    const Vector away = by_a ? placement_.offset : Vector(-placement_.offset);
    const Vector out = axis.dot(away) < 0 ? Vector(-axis) : axis;
    const PlacedCore<Scalar> placed(other, by_a ? placement_.b : placement_.a,
                                    by_a ? placement_.offset : Vector(Vector::Zero()));
    const Vector lowest = placed.shape_support(Vector(-out));
    const Vector lever = lowest - middle;
    const Scalar height = out.dot(lever) - flat.half.z();
    if (height > reach_) return AxialCase::kApart;
    if (height < -flat.margin) return AxialCase::kUnknown;
    const Scalar radius = flat.half.x();
    const Vector aside = lever - out * out.dot(lever);
    if (aside.squaredNorm() > radius * radius && !is_level(out, away)) return AxialCase::kUnknown;
    const Vector foot = lowest - height * out;
    found = by_a ? Closest<Scalar>{-out, foot, lowest, height} : Closest<Scalar>{out, lowest, foot, height};
    return AxialCase::kFound;
  }

  // The direction between what is closest of two axes, once their sides have been looked at; unit length.
  const Vector& between_axes() const { return between_axes_; }

  static bool is_flat(const Core<Scalar>& core) { return core.kind == Kind::kCylinder; }

 private:
  static Scalar radius_of(const Core<Scalar>& core) { return is_flat(core) ? core.half.x() : core.margin; }

  // Whether the place on an axis, from 0 to 1, is that of a point on the side of the shape, or of a round
  // end.
  static bool is_beside(const Core<Scalar>& core, Scalar place) {
    return !is_flat(core) || (place > 0 && place < 1);
  }

  // Of axes along each other, from the middle of where they are beside each other, across a's.
  bool lie_along(Vector& on_a, Vector& away) const {
    const Scalar cosine = axis_a_.dot(axis_b_);
    if (axis_a_.cross(axis_b_).squaredNorm() > Scalar(kLevelSine * kLevelSine)) return false;
    const Scalar middle = axis_a_.dot(placement_.offset);
    const Scalar half = std::abs(cosine) * b_.half.z();
    const Scalar from = std::max(-a_.half.z(), middle - half);
    const Scalar to = std::min(a_.half.z(), middle + half);
    if (!(to > from)) return false;
    const Scalar place = (from + to) / 2;
    on_a = place * axis_a_;
    away = on_a - (placement_.offset + (place - middle) / cosine * axis_b_);
    return away.squaredNorm() > 0;
  }

  // Whether both are cylinders whose caps are level, one over the other.
  bool is_level(const Vector& out, const Vector& away) const {
    if (!is_flat(a_) || !is_flat(b_)) return false;
    if (axis_a_.cross(axis_b_).squaredNorm() > Scalar(kLevelSine * kLevelSine)) return false;
    const Scalar radius = a_.half.x() + b_.half.x();
    return (away - out * out.dot(away)).squaredNorm() < radius * radius;
  }

  const Core<Scalar>& a_;
  const Core<Scalar>& b_;
  const Placement<Scalar>& placement_;
  Scalar reach_;
  Vector axis_a_;
  Vector axis_b_;
  Vector between_axes_ = Vector::UnitZ();
  Scalar deepest_;  // m, of overlaps whose shortest way is that of the sides
};

// The direction along which the cores of two axial shapes are farthest apart, by Newton's method: on the unit
// sphere, and that is where the rims of caps are closest, the distance is smooth, and curved by the radii of
// the rims. Where a side is closest, the direction stays across its axis.
template <typename Scalar>
class RimSearch {
 public:
  using Vector = Vector3<Scalar>;

  RimSearch(const Core<Scalar>& a, const Core<Scalar>& b, const Placement<Scalar>& placement, Scalar reach)
      : apart_(-placement.offset),
        margin_a_(a.margin),
        margin_b_(b.margin),
        reach_(reach),
        end_{End(a, placement.a.col(2)), End(b, placement.b.col(2))} {}

  AxialCase run(Vector normal, Closest<Scalar>& found) {
    constexpr int kPassesMax = 12;
    for (End& end : end_) end.side = end.axis.dot(normal) < 0 ? Scalar(-1) : Scalar(1);
    for (int pass = 0; pass < kPassesMax; ++pass) {
      if (!look(normal)) return AxialCase::kUnknown;
      const Scalar gap = distance_ - margin_a_ - margin_b_ - rounded_off();
      if (gap > reach_) return AxialCase::kApart;
      const Vector step = newton_step(normal);
      const Scalar square = step.squaredNorm();
      const Scalar most = Scalar(0.5);
      normal += square > most * most ? Vector(step * (most / std::sqrt(square))) : step;
      const bool is_new_a = hold(end_[0], end_[1], normal);
      const bool is_new_b = hold(end_[1], end_[0], normal);
      normal.normalize();
      // The next step would be of the order of the square of this one.
      if (!(square < kConverged) || is_new_a || is_new_b) continue;
      if (!look(normal)) return AxialCase::kUnknown;
      if (release()) continue;
      if (!(distance_ > kNear * (margin_a_ + margin_b_))) return AxialCase::kUnknown;
      take(normal, distance_ - margin_a_ - margin_b_ - rounded_off(), found);
      return found.gap > reach_ ? AxialCase::kApart : AxialCase::kFound;
    }
    return AxialCase::kUnknown;
  }

 private:
  static constexpr Scalar kConverged = Scalar(sizeof(Scalar) == sizeof(float) ? 1e-6 : 1e-12);
  static constexpr Scalar kNear = Scalar(0.01);  // of the margins: what is closer tells no direction

  // A disc around an axis, swept along it to both sides: the core of a cylinder, or of a capsule.
  struct End {
    End(const Core<Scalar>& core, const Vector& its)
        : axis(its),
          radius(AxialPair<Scalar>::is_flat(core) ? core.half.x() - core.margin : Scalar(0)),
          half(AxialPair<Scalar>::is_flat(core) ? core.half.z() - core.margin : core.half.z()),
          rounded(AxialPair<Scalar>::is_flat(core) ? core.margin : Scalar(0)) {}

    Vector axis;
    Scalar radius;
    Scalar half;
    Scalar rounded;  // m, the margin that rounds a rim off
    Scalar side = 1;
    bool is_held = false;
    // As seen along a direction:
    Vector out;         // unit length, across the axis
    Vector across;      // unit length, across both
    Scalar length = 0;  // of the direction's part across the axis
    Scalar along = 0;
    Scalar place = 0;  // of what is closest, along the axis
  };

  // Where a direction is about to change sides, it stays across the axis: of one of the two. Whether that is
  // new.
  static bool hold(End& end, End& other, Vector& normal) {
    const Scalar along = end.axis.dot(normal);
    if (end.half == 0 || (!end.is_held && along * end.side > 0)) return false;
    const bool is_new = !end.is_held;
    if (is_new && other.is_held) {
      other.is_held = false;
      other.side = other.place < 0 ? Scalar(-1) : Scalar(1);
    }
    end.is_held = true;
    normal -= along * end.axis;
    return is_new;
  }

  // False where a direction is that of an axis.
  bool look(const Vector& normal) {
    difference_ = apart_;
    for (End& end : end_) {
      end.along = end.axis.dot(normal);
      end.out = normal - end.along * end.axis;
      end.length = end.out.norm();
      if (end.radius > 0) {
        if (!(end.length > Scalar(1e-3))) return false;
        end.out /= end.length;
        difference_ -= end.radius * end.out;
      }
      end.place = end.is_held ? Scalar(0) : end.side * end.half;
      difference_ -= end.place * end.axis;
    }
    for (End& end : end_) {
      if (!end.is_held) continue;
      end.place = end.axis.dot(difference_);
      difference_ -= end.place * end.axis;
    }
    distance_ = normal.dot(difference_);
    return true;
  }

  Scalar rounded_off() const {
    Scalar sum = 0;
    for (const End& end : end_) sum += end.rounded * (end.length + std::abs(end.along) - 1);
    return sum;
  }

  // In the plane across the direction, of which the part along a held axis is no way to go.
  Vector newton_step(const Vector& normal) {
    const bool is_held = end_[0].is_held || end_[1].is_held;
    const Vector& other = end_[0].is_held ? end_[0].axis : end_[1].axis;
    int least = 0;
    normal.cwiseAbs().minCoeff(&least);
    const Vector v = is_held ? other : Vector(normal.cross(Vector::Unit(least)).normalized());
    const Vector u = v.cross(normal);
    // Where cores overlap along the direction, the way up is not that curved.
    const Scalar bend = std::max(distance_, Scalar(0.25) * (margin_a_ + margin_b_));
    Scalar uu = bend;
    Scalar uv = 0;
    Scalar vv = bend;
    for (const End& end : end_) {
      if (!(end.radius > 0)) continue;
      const Vector across = end.axis.cross(end.out);
      const Scalar curve = end.radius / end.length;
      const Scalar on_u = across.dot(u);
      const Scalar on_v = across.dot(v);
      uu += curve * on_u * on_u;
      uv += curve * on_u * on_v;
      vv += curve * on_v * on_v;
    }
    const Scalar gu = difference_.dot(u);
    if (is_held) return u * (gu / uu);
    const Scalar gv = difference_.dot(v);
    const Scalar determinant = uu * vv - uv * uv;
    return u * ((vv * gu - uv * gv) / determinant) + v * ((uu * gv - uv * gu) / determinant);
  }

  // Lets go what was held where its rim is closer than its side.
  bool release() {
    for (End& end : end_) {
      if (!end.is_held || std::abs(end.place) <= end.half) continue;
      end.is_held = false;
      end.side = end.place < 0 ? Scalar(-1) : Scalar(1);
      return true;
    }
    return false;
  }

  void take(const Vector& normal, Scalar gap, Closest<Scalar>& found) const {
    const End& a = end_[0];
    const Scalar more = margin_a_ + a.rounded * (a.length + std::abs(a.along) - 1);
    found.normal = normal;
    found.on_a = -(a.place * a.axis + (a.radius > 0 ? Vector(a.radius * a.out) : Vector(Vector::Zero()))) -
                 more * normal;
    found.on_b = found.on_a - gap * normal;
    found.gap = gap;
  }

  Vector apart_;  // m, from the centre of b to that of a
  Scalar margin_a_;
  Scalar margin_b_;
  Scalar reach_;
  End end_[2];
  Vector difference_ = Vector::Zero();  // m, from what is closest of b to what is of a
  Scalar distance_ = 0;
};

}  // namespace

template <typename Scalar>
AxialCase closest_axial(const Core<Scalar>& a, const Core<Scalar>& b, const Placement<Scalar>& placement,
                        std::type_identity_t<Scalar> reach, const Vector3<Scalar>& before,
                        Closest<Scalar>& found) {
  using Pair = AxialPair<Scalar>;
  Pair pair(a, b, placement, reach);
  if (is_axial(a) && is_axial(b)) {
    const AxialCase sides = pair.look_at_sides(found);
    if (sides != AxialCase::kUnknown) return sides;
  }
  for (const bool by_a : {true, false}) {
    if (!Pair::is_flat(by_a ? a : b)) continue;
    const AxialCase cap = pair.look_at_cap(by_a, found);
    if (cap != AxialCase::kUnknown) return cap;
  }
  if (!is_axial(a) || !is_axial(b)) return AxialCase::kUnknown;
  const Vector3<Scalar>& first = before.isZero(0) ? pair.between_axes() : before;
  return RimSearch<Scalar>(a, b, placement, reach).run(first, found);
}

template AxialCase closest_axial(const Core<float>&, const Core<float>&, const Placement<float>&, float,
                                 const Vector3<float>&, Closest<float>&);
template AxialCase closest_axial(const Core<double>&, const Core<double>&, const Placement<double>&, double,
                                 const Vector3<double>&, Closest<double>&);

}  // namespace tessera::collision
