// The shape of a body in the forms that finding contacts needs.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexShape.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "lpss/bullet/collision_shape.h"
#include "lpss/collision/collide.h"
#include "lpss/collision/core.h"
#include "lpss/native/material.h"
#include "lpss/native/math.h"
#include "lpss/native/solid_hull.h"
#include "lpss/native/terrain.h"

namespace tessera::native {

// One geometry of a shape.
struct Part {
  enum class Kind : std::uint8_t {
    kBall,
    kCapsule,
    kBox,
    kPolyhedron,
    kRound,  // other convex shapes, and hulls of very many faces
    kPlane,
    kTerrain,
  };

  Kind kind = Kind::kBall;
  Frame frame;             // in the centre frame of the body
  bool is_placed = false;  // the frame is not the identity
  Bounds bounds;           // in the part's frame
  collision::Ball<Scalar> ball{};
  double radius = 0;  // m, of balls
  // m, of boxes half the edges, of ellipsoids the radii, of capsules and cylinders the radius, twice, and
  // half the length. As the shape has them, not rounded.
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  collision::Capsule<Scalar> capsule{};
  collision::Box<Scalar> cuboid{};
  const collision::Polyhedron<Scalar>* polyhedron = nullptr;  // of hulls, also large ones: their faces
  std::span<const collision::HalfSpace<double>> planes;       // of hulls, not simplified
  Vector normal = Vector::UnitZ();                            // of a plane, pointing out
  const btConvexShape* convex = nullptr;                      // of all convex kinds
  collision::Core<Scalar> core;                               // likewise
  const Terrain* terrain = nullptr;
  std::shared_ptr<const Material> material;                  // none: that of the body
  btCollisionShape* surface = nullptr;                       // of terrains, for rays
  Eigen::Vector3d surface_origin = Eigen::Vector3d::Zero();  // m, its own in the frame of the part
};

bool is_cylinder(const Part& part);
bool is_ellipsoid(const Part& part);

struct SweptBall {
  Vector centre;
  Scalar radius;           // m; 0.4 of the smallest extent
  std::uint32_t part = 0;  // that it stands for
};

// Immutable; shared by all bodies of a shape and centre frame.
class Solid {
 public:
  // As CollisionShape: for a static body of one part the part's pose is `offset`, to be applied to the body's
  // own.
  Solid(const Shape& shape, const Pose& centre, bool is_static);

  const std::vector<Part>& parts() const { return parts_; }

  // Whether a part has a material of its own.
  bool has_materials() const { return has_materials_; }
  const Frame& offset() const { return offset_; }

  // m, the distance from which on contacts are kept.
  Scalar margin() const { return margin_; }

  // m, the smallest one; of compounds, that of their bounds; 0 for surfaces.
  Scalar extent() const { return extent_; }

  // What is swept in the place of the shape: a ball in the middle of each of its convex parts. In the centre
  // frame; none for surfaces.
  const std::vector<SweptBall>& swept_balls() const { return swept_balls_; }

  // m, of a ball around the centre; for surfaces, too large to matter.
  Scalar radius() const { return radius_; }

  // Of all parts, in the centre frame.
  const Bounds& bounds() const { return bounds_; }

  // m, how far a turn can bring a point of the shape to where nothing of it was: from a ball inside, around
  // the centre, to the radius. 0 for balls.
  Scalar swing() const { return swing_; }

  // Of length 1, in the centre frame: a turn about it changes nothing. 0 if there is none.
  const Vector& round_axis() const { return round_axis_; }

  // Of the shape posed by `frame`.
  Bounds bounds_at(const Frame& frame) const;

  // For sweeps, and rays at surfaces.
  btCollisionShape* bullet() const { return bullet_.root(); }

  // The parts whose boxes overlap `bounds`, ascending. In the centre frame.
  void parts_near(const Bounds& bounds, std::vector<std::uint32_t>& found) const;

 private:
  using Hulls = std::vector<std::optional<SolidHull>>;  // by part

  Solid(const Shape& shape, const Pose& centre, bool is_static, const Hulls& hulls);
  static Hulls hulls_of(const Shape& shape);
  static bullet::CollisionShape bullet_shape(const Shape& shape, const Pose& centre, bool is_static,
                                             const Hulls& hulls);
  Part make_part(const Geometry& geometry, const Pose& pose, btCollisionShape* bullet, const SolidHull* hull);
  void set_hull(const SolidHull& hull, const Pose& pose, Part& part);
  void set_core(const Geometry& geometry, Part& part);
  void add_swept_ball(const Part& part, Scalar extent);
  void find_swing();

  bullet::CollisionShape bullet_;
  Frame offset_;
  std::vector<Part> parts_;
  std::vector<std::unique_ptr<collision::Polyhedron<Scalar>>> polyhedra_;
  std::vector<std::vector<Vector>> core_points_;
  std::vector<std::vector<collision::HalfSpace<double>>> planes_;
  std::vector<std::unique_ptr<Terrain>> terrains_;
  std::vector<SweptBall> swept_balls_;
  Bounds bounds_;  // of all parts, in the centre frame
  Scalar margin_ = 0;
  Scalar extent_ = 0;
  Scalar radius_ = 0;
  bool has_materials_ = false;
  Scalar swing_ = 0;
  Vector round_axis_ = Vector::Zero();
};

// Of a part posed by `frame`, that of its body.
Bounds bounds_at(const Part& part, const Frame& frame);

// The point of a convex part that is farthest in a direction, both in the part's frame.
Vector farthest(const Part& part, const Vector& direction);

}  // namespace tessera::native
