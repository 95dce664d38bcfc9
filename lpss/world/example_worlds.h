// Small worlds made in code, for tests and experiments.
#pragma once

#include <Eigen/Core>
#include <string>

#include "lpss/world/world_description.h"

namespace tessera {

// Builds a world body by body; equal shapes are added once by the caller. Positions are relative to the anchor's
// centre and may be of any size.
class WorldBuilder {
 public:
  explicit WorldBuilder(const WorldSettings& settings) { world_.settings = settings; }

  ShapeId shape(Geometry geometry);

  // A solid of homogeneous density; the principal moments follow from the shape (that of its bounding box where
  // it is not a box, sphere or cylinder).
  BodyDescription& add(const std::string& name, ShapeId shape, double mass, const Eigen::Vector3d& position,
                       Motion motion = Motion::kDynamic);

  // A floor of 2 m thickness whose top is at `height`.
  void add_floor(double half_size, double height);

  const WorldDescription& world() const { return world_; }
  WorldDescription& world() { return world_; }

 private:
  WorldDescription world_;
};

// A tower of `count` boxes of 1 m on a floor at `base`, slightly out of line: i * 7 % 5 * 0.02 m, as in the
// measurements of the design.
WorldDescription tower_world(const WorldSettings& settings, int count, const Eigen::Vector3d& base);

// `count` boxes, balls, cylinders and capsules poured onto a floor around the corner where eight sectors meet.
WorldDescription pile_world(const WorldSettings& settings, int count);

}  // namespace tessera
