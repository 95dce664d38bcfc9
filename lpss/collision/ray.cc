#include "lpss/collision/ray.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The part of a ray inside of what several constraints share, and the normal of the one that it meets last.
struct Inside {
  double enter = -kInfinity;
  double exit = kInfinity;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();

  void enters(double t, const Eigen::Vector3d& n) {
    if (t <= enter) return;
    enter = t;
    normal = n;
  }
  void leaves(double t) { exit = std::min(exit, t); }
  // Below a plane `height` under the start, towards which the ray climbs by `climb` in 1; false if it never
  // is.
  bool below(double height, double climb, const Eigen::Vector3d& n) {
    if (climb < 0) {
      enters(-height / climb, n);
    } else if (climb > 0) {
      leaves(-height / climb);
    } else {
      return height <= 0;
    }
    return true;
  }
  std::optional<RayContact> contact(const Ray& ray) const {
    if (!(enter <= exit) || !(enter >= ray.first) || !(enter <= ray.last)) return std::nullopt;
    return RayContact{enter, normal};
  }
};

// Where a line is in a circle or ball of radius 1 times `radius`, from the place where it is closest to the
// middle, so that no large numbers cancel.
template <typename Vector>
struct Chord {
  Chord(const Vector& from, const Vector& way, double radius) {
    const double square = way.squaredNorm();
    middle = -from.dot(way) / square;
    const Vector closest = from + middle * way;
    // (r - d)(r + d), which tells more digits of a small rest than r^2 - d^2.
    const double distance = closest.norm();
    const double rest = (radius - distance) * (radius + distance);
    is_there = rest >= 0;
    half = is_there ? std::sqrt(rest / square) : 0;
  }

  bool is_there = false;
  double middle = 0;
  double half = 0;
};

std::optional<RayContact> earlier(const std::optional<RayContact>& a, const std::optional<RayContact>& b) {
  if (!a) return b;
  return b && b->t < a->t ? b : a;
}

// With its centre at (0, 0, z).
std::optional<RayContact> meet_cap(const Ray& ray, double radius, double z) {
  const Ray beside{ray.from - Eigen::Vector3d(0, 0, z), ray.way, ray.first, ray.last};
  return meet_ball(beside, radius);
}

}  // namespace

bool Ray::is_sensible() const {
  const double square = way.squaredNorm();
  return square > 0 && square < kInfinity && from.allFinite() && std::isfinite(first) && std::isfinite(last);
}

Ray Ray::beside(const Eigen::Vector3d& centre, double& moved) const {
  moved = (centre - from).dot(way) / way.squaredNorm();
  return {from + moved * way, way, first - moved, last - moved};
}

std::optional<RayContact> meet_ball(const Ray& ray, double radius) {
  if (!ray.is_sensible()) return std::nullopt;
  const Chord chord(ray.from, ray.way, radius);
  if (!chord.is_there) return std::nullopt;
  const double t = chord.middle - chord.half;
  if (!(t >= ray.first && t <= ray.last)) return std::nullopt;
  const Eigen::Vector3d closest = ray.from + chord.middle * ray.way;
  return RayContact{t, (closest - chord.half * ray.way).normalized()};
}

std::optional<RayContact> meet_box(const Ray& ray, const Eigen::Vector3d& half) {
  if (!ray.is_sensible()) return std::nullopt;
  Inside inside;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1., 1.}) {
      const double height = side * ray.from[axis] - half[axis];
      if (!inside.below(height, side * ray.way[axis], side * Eigen::Vector3d::Unit(axis)))
        return std::nullopt;
    }
  }
  return inside.contact(ray);
}

std::optional<RayContact> meet_ellipsoid(const Ray& ray, const Eigen::Vector3d& radii) {
  if (!ray.is_sensible()) return std::nullopt;
  const Ray in_ball{ray.from.cwiseQuotient(radii), ray.way.cwiseQuotient(radii), ray.first, ray.last};
  std::optional<RayContact> contact = meet_ball(in_ball, 1);
  if (contact) contact->normal = contact->normal.cwiseQuotient(radii).normalized();
  return contact;
}

std::optional<RayContact> meet_capsule(const Ray& ray, double radius, double half_length) {
  if (!ray.is_sensible()) return std::nullopt;
  const Eigen::Vector3d start = ray.from + ray.first * ray.way;
  const double beyond = std::max(std::abs(start.z()) - half_length, 0.);
  // From inside of one of its parts, another one may be met.
  if (start.head<2>().squaredNorm() + beyond * beyond < radius * radius) return std::nullopt;
  std::optional<RayContact> nearest =
      earlier(meet_cap(ray, radius, -half_length), meet_cap(ray, radius, half_length));
  const Eigen::Vector2d way = ray.way.head<2>();
  if (!(way.squaredNorm() > 0)) return nearest;
  const Chord chord(Eigen::Vector2d(ray.from.head<2>()), way, radius);
  const double t = chord.middle - chord.half;
  if (!chord.is_there || !(t >= ray.first && t <= ray.last)) return nearest;
  if (std::abs(ray.from.z() + t * ray.way.z()) > half_length) return nearest;
  const Eigen::Vector2d out = ray.from.head<2>() + chord.middle * way - chord.half * way;
  return earlier(nearest, RayContact{t, Eigen::Vector3d(out.x(), out.y(), 0).normalized()});
}

std::optional<RayContact> meet_cylinder(const Ray& ray, double radius, double half_length) {
  if (!ray.is_sensible()) return std::nullopt;
  Inside inside;
  for (const double side : {-1., 1.}) {
    const double height = side * ray.from.z() - half_length;
    if (!inside.below(height, side * ray.way.z(), side * Eigen::Vector3d::UnitZ())) return std::nullopt;
  }
  const Eigen::Vector2d way = ray.way.head<2>();
  if (way.squaredNorm() > 0) {
    const Chord chord(Eigen::Vector2d(ray.from.head<2>()), way, radius);
    if (!chord.is_there) return std::nullopt;
    const Eigen::Vector2d out = ray.from.head<2>() + chord.middle * way - chord.half * way;
    inside.enters(chord.middle - chord.half, Eigen::Vector3d(out.x(), out.y(), 0).normalized());
    inside.leaves(chord.middle + chord.half);
  } else if (!(ray.from.head<2>().squaredNorm() <= radius * radius)) {
    return std::nullopt;
  }
  return inside.contact(ray);
}

std::optional<RayContact> meet_planes(const Ray& ray, std::span<const HalfSpace<double>> planes) {
  if (!ray.is_sensible() || planes.empty()) return std::nullopt;
  Inside inside;
  for (const HalfSpace<double>& plane : planes) {
    const double height = plane.normal.dot(ray.from) - plane.offset;
    if (!inside.below(height, plane.normal.dot(ray.way), plane.normal)) return std::nullopt;
    if (inside.enter > inside.exit) return std::nullopt;
  }
  return inside.contact(ray);
}

std::optional<RayContact> meet_surface(const Ray& ray, const HalfSpace<double>& plane) {
  if (!ray.is_sensible()) return std::nullopt;
  const double climb = plane.normal.dot(ray.way);
  if (climb == 0) return std::nullopt;
  const double t = (plane.offset - plane.normal.dot(ray.from)) / climb;
  if (!(t >= ray.first && t <= ray.last)) return std::nullopt;
  return RayContact{t, climb < 0 ? plane.normal : Eigen::Vector3d(-plane.normal)};
}

std::optional<RayContact> meet_triangle(const Ray& ray, const std::array<Eigen::Vector3d, 3>& corners) {
  if (!ray.is_sensible()) return std::nullopt;
  // Six times the volumes between the ray and each edge: of an edge seen the other way round, the same with
  // the other sign, to the last bit.
  double least = kInfinity;
  double most = -kInfinity;
  std::array<Eigen::Vector3d, 3> seen;
  for (std::size_t k = 0; k < 3; ++k) seen[k] = corners[k] - ray.from;
  for (std::size_t k = 0; k < 3; ++k) {
    const double volume = seen[k].cross(seen[(k + 1) % 3]).dot(ray.way);
    least = std::min(least, volume);
    most = std::max(most, volume);
  }
  if (!(least >= 0 || most <= 0)) return std::nullopt;
  const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double area = normal.norm();
  if (!(area > 0)) return std::nullopt;
  return meet_surface(ray, {normal / area, normal.dot(corners[0]) / area});
}

}  // namespace tessera::collision
