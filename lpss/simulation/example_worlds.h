// Small worlds made in code, for tests and experiments.
#pragma once

#include <Eigen/Core>
#include <string>

#include "lpss/model/world_description.h"

namespace tessera {

inline constexpr double kChainLink = 0.5;  // m, from joint to joint

// Builds a world body by body; equal shapes are added once by the caller. Positions are relative to the
// anchor's centre and may be of any size.
class WorldBuilder {
 public:
  explicit WorldBuilder(const WorldSettings& settings) { world_.settings = settings; }

  ShapeId shape(Geometry geometry);

  // A solid of homogeneous density; the principal moments follow from the shape (that of its bounding box
  // where it is not a box, sphere or cylinder).
  BodyDescription& add(const std::string& name, ShapeId shape, double mass, const Eigen::Vector3d& position,
                       Motion motion = Motion::kDynamic);

  // Ties the body `child` to the body `parent` (names; "" is the world) at `position`, with `axis` as the
  // joint's first axis, such that the bodies are at its zero now.
  JointDescription& tie(const std::string& name, JointType type, const std::string& parent,
                        const std::string& child, const Eigen::Vector3d& position,
                        const Eigen::Vector3d& axis = Eigen::Vector3d::UnitX());

  // A chain of `links` capsules of kChainLink, "link0" and so on, from `base` along `way` (unit length), tied
  // to each other by balls, "joint0" and so on, and the first to the world. The name of the last link.
  std::string add_chain(int links, const Eigen::Vector3d& base, const Eigen::Vector3d& way);

  // A floor of 2 m thickness whose top is at `height`.
  void add_floor(double half_size, double height);

  const WorldDescription& world() const { return world_; }
  WorldDescription& world() { return world_; }

 private:
  std::size_t place_of(const std::string& body) const;

  WorldDescription world_;
};

// All of a world in a frame that moves: its sectors become those of the frame, at the same places.
WorldDescription aboard(const MovingFrame& frame, WorldDescription world);

// A tower of `count` boxes of 1 m on a floor at `base`, slightly out of line: i * 7 % 5 * 0.02 m, as in the
// measurements of the design.
WorldDescription tower_world(const WorldSettings& settings, int count, const Eigen::Vector3d& base);

// A pyramid of `rows` rows along x, centred at x = 0, of boxes of 1 m that are 1.05 m apart, on a floor at
// z = 0: one island.
WorldDescription pyramid_world(const WorldSettings& settings, int rows);

// A chain of `links` capsules that hangs level from the world at `base` and falls into a swing.
WorldDescription chain_world(const WorldSettings& settings, int links, const Eigen::Vector3d& base);

// A square of triangles around the origin, from -half_size to half_size (m) along x and y, two to each square
// of `cell` m, whose hills are half a metre high.
TriangleMesh hills(double half_size, double cell = 2);

// Corners of a box that is cut off at the top: a solid of eight corners and six faces.
ConvexHull stone();

// `count` boxes, balls, cylinders and capsules poured onto a floor around the corner where eight sectors
// meet.
WorldDescription pile_world(const WorldSettings& settings, int count);

}  // namespace tessera
