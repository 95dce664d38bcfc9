#include "lpss/collision/simplex.h"

#include <array>

namespace tessera::collision {
namespace {

// The closest points of all parts of a simplex that hold its last point. By cross products of its sides
// there, which keep more digits of thin triangles than products of their lengths do.
template <typename Scalar>
class AtLastPoint {
 public:
  using Vector = Vector3<Scalar>;

  explicit AtLastPoint(const Simplex<Scalar>& simplex)
      : last_(simplex.count - 1), point_(simplex.point[last_].at) {
    for (int i = 0; i < last_; ++i) {
      side_[i] = simplex.point[i].at - point_;
      moment_[i] = side_[i].cross(point_);
    }
  }

  // Of four points.
  bool holds_origin() const {
    const Vector across = side_[1].cross(side_[2]);
    const Scalar volume = side_[0].dot(across);
    const Scalar sign = volume < 0 ? Scalar(-1) : Scalar(1);
    const Scalar u = -sign * point_.dot(across);
    const Scalar v = -sign * side_[2].dot(moment_[0]);
    const Scalar w = sign * side_[1].dot(moment_[0]);
    return u >= 0 && v >= 0 && w >= 0 && u + v + w <= sign * volume && volume != 0;
  }

  ClosestOfSimplex<Scalar> find() {
    least_ = point_.squaredNorm();
    take(point_, {last_, 0, 0}, {1, 0, 0}, 1);
    for (int i = 0; i < last_; ++i) try_side(i);
    for (int i = 1; i < last_; ++i) {
      for (int j = 0; j < i; ++j) try_face(j, i);
    }
    return best_;
  }

 private:
  void try_side(int i) {
    const Scalar way = -side_[i].dot(point_);
    const Scalar square = side_[i].squaredNorm();
    if (!(way > 0 && way < square)) return;
    const Scalar distance = moment_[i].squaredNorm() / square;
    if (!(distance < least_)) return;
    least_ = distance;
    const Scalar t = way / square;
    take(point_ + t * side_[i], {i, last_, 0}, {t, 1 - t, 0}, 2);
  }

  void try_face(int i, int j) {
    const Vector normal = side_[i].cross(side_[j]);
    const Scalar u = normal.dot(moment_[j]);
    const Scalar v = -normal.dot(moment_[i]);
    const Scalar square = normal.squaredNorm();
    if (!(u > 0 && v > 0 && u + v < square)) return;
    const Scalar height = normal.dot(point_);
    const Scalar distance = height * height / square;
    if (!(distance < least_)) return;
    least_ = distance;
    take(normal * (height / square), {i, j, last_}, {u / square, v / square, (square - u - v) / square}, 3);
  }

  void take(const Vector& at, const std::array<int, 3>& places, const std::array<Scalar, 3>& weights,
            int count) {
    best_.at = at;
    best_.count = count;
    best_.place = places;
    best_.weight = weights;
  }

  int last_;
  Vector point_;      // the last one
  Vector side_[3];    // from there to the others
  Vector moment_[3];  // of the sides, about the origin
  Scalar least_;      // m^2
  ClosestOfSimplex<Scalar> best_;
};

}  // namespace

template <typename Scalar>
ClosestOfSimplex<Scalar> Simplex<Scalar>::closest(bool may_hold_origin) const {
  AtLastPoint<Scalar> parts(*this);
  if (may_hold_origin && count == 4 && parts.holds_origin()) return {};
  return parts.find();
}

template <typename Scalar>
void Simplex<Scalar>::keep(const ClosestOfSimplex<Scalar>& closest) {
  count = closest.count;
  for (int n = 0; n < count; ++n) {
    if (closest.place[n] != n) point[n] = point[closest.place[n]];
    weight[n] = closest.weight[n];
  }
}

template struct Simplex<float>;
template struct Simplex<double>;

}  // namespace tessera::collision
