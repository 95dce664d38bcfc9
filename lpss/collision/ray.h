// Where rays meet shapes, in closed form and in double precision, in the frame of the shape.
//
// A solid is met where a ray enters it: one that begins inside of it does not meet it, whereas one that
// begins on the surface and goes inwards does, at once. A ray that touches a round surface meets it. The
// normal is that of the surface, towards the outside; where faces meet, it is that of one of them. The bits
// of the result depend on the arguments alone, and no function allocates memory. A ray without length, or one
// of which anything is not a finite number, meets nothing.
//
// Source: Ericson, Real-Time Collision Detection, 2005, section 5.3.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "lpss/collision/shapes.h"

namespace tessera::collision {

// The points from + t * way of which `t` is from `first` to `last`. Results are the more exact, the nearer
// `from` is to the shape: see beside().
struct Ray {
  Eigen::Vector3d from;
  Eigen::Vector3d way;
  double first = 0;
  double last = 1;

  bool is_sensible() const;
  // The same points, with `from` where the line of the ray is closest to `centre`; t grows by `moved`.
  Ray beside(const Eigen::Vector3d& centre, double& moved) const;
};

struct RayContact {
  double t = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit length
};

std::optional<RayContact> meet_ball(const Ray& ray, double radius);
std::optional<RayContact> meet_box(const Ray& ray, const Eigen::Vector3d& half);
std::optional<RayContact> meet_ellipsoid(const Ray& ray, const Eigen::Vector3d& radii);
// Along z, as Capsule.
std::optional<RayContact> meet_capsule(const Ray& ray, double radius, double half_length);
std::optional<RayContact> meet_cylinder(const Ray& ray, double radius, double half_length);
// What the half spaces share.
std::optional<RayContact> meet_planes(const Ray& ray, std::span<const HalfSpace<double>> planes);

// Surfaces are met from both sides; the normal is towards the side from which the ray comes. Neighbouring
// triangles leave no gap at the edge that they share.
std::optional<RayContact> meet_surface(const Ray& ray, const HalfSpace<double>& plane);
std::optional<RayContact> meet_triangle(const Ray& ray, const std::array<Eigen::Vector3d, 3>& corners);

}  // namespace tessera::collision
