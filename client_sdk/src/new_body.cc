// Bodies to spawn: shapes and their inertia.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "tessera/client.h"

namespace tessera {
namespace {

using Moments = std::array<double, 3>;

Moments round_about_z(double across, double along) { return {across, across, along}; }

// Principal moments (kg m^2) of a solid of uniform density and `mass`.
struct MomentsOf {
  double mass;

  Moments operator()(const Box& box) const {
    const Eigen::Vector3d square = box.size.cwiseAbs2() * (mass / 12);
    return {square.y() + square.z(), square.x() + square.z(), square.x() + square.y()};
  }
  Moments operator()(const Sphere& sphere) const {
    const double moment = 0.4 * mass * sphere.radius * sphere.radius;
    return {moment, moment, moment};
  }
  Moments operator()(const Cylinder& cylinder) const {
    const double r2 = cylinder.radius * cylinder.radius;
    return round_about_z(mass * (3 * r2 + cylinder.length * cylinder.length) / 12, mass * r2 / 2);
  }
  // A cylinder and two half balls, whose centres of mass are 3/8 of a radius from their flat sides.
  Moments operator()(const Capsule& capsule) const {
    const double r = capsule.radius;
    const double l = capsule.length;
    const double volume_middle = std::numbers::pi * r * r * l;
    const double volume_ends = std::numbers::pi * r * r * r * 4 / 3;
    const double middle = mass * volume_middle / (volume_middle + volume_ends);
    const double ends = mass - middle;
    const double across =
        middle * (3 * r * r + l * l) / 12 + ends * (0.4 * r * r + l * l / 4 + 3 * l * r / 8);
    return round_about_z(across, middle * r * r / 2 + ends * 0.4 * r * r);
  }
  Moments operator()(const Ellipsoid& ellipsoid) const {
    const Eigen::Vector3d square = ellipsoid.radii.cwiseAbs2() * (mass / 5);
    return {square.y() + square.z(), square.x() + square.z(), square.x() + square.y()};
  }
  template <typename Other>
  Moments operator()(const Other& other) const {
    return (*this)(Sphere{bounding_radius(Geometry(other))});
  }
};

bool is_solid(const ShapePart& part) { return !part.material || !part.material->trigger; }

// Triggers do not count beside other parts.
Moments moments_of(const Shape& whole, double mass) {
  const MomentsOf moments{mass};
  Shape shape;
  std::ranges::copy_if(whole.parts, std::back_inserter(shape.parts), is_solid);
  if (shape.parts.empty()) shape = whole;
  if (shape.parts.size() == 1 && shape.parts.front().pose.is_identity()) {
    return std::visit(moments, shape.parts.front().geometry);
  }
  return moments(Sphere{bounding_radius(shape, Eigen::Vector3d::Zero())});
}

Shape one(Geometry geometry) { return Shape{{ShapePart{std::move(geometry), Pose{}}}}; }

}  // namespace

Shape box(double x, double y, double z) { return one(Box{{x, y, z}}); }
Shape sphere(double radius) { return one(Sphere{radius}); }
Shape capsule(double radius, double length) { return one(Capsule{radius, length}); }
Shape cylinder(double radius, double length) { return one(Cylinder{radius, length}); }

Shape trigger(Shape shape) {
  for (ShapePart& part : shape.parts) {
    if (!part.material) part.material.emplace();
    part.material->trigger = true;
  }
  return shape;
}

NewBody solid(std::string name, Shape shape, double mass, const WorldPosition& position) {
  NewBody body;
  body.body.name = std::move(name);
  body.body.properties.mass = mass;
  body.body.properties.inertia = moments_of(shape, mass);
  body.body.pose.position = position;
  body.shape = std::move(shape);
  return body;
}

}  // namespace tessera
