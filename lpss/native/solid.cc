#include "lpss/native/solid.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

namespace tessera::native {

using Core = collision::Core<Scalar>;

bool is_cylinder(const Part& part) {
  return part.kind == Part::Kind::kRound && part.core.kind == Core::Kind::kCylinder;
}

bool is_ellipsoid(const Part& part) {
  return part.kind == Part::Kind::kRound && part.core.kind == Core::Kind::kEllipsoid;
}

namespace {

constexpr Scalar kMarginMax = Scalar(0.02);   // m
constexpr Scalar kMarginShare = Scalar(0.2);  // of the smallest extent
constexpr Scalar kSweptShare = Scalar(0.4);   // of the smallest extent, the radius of a swept ball
constexpr Scalar kFar = Scalar(1e5);          // m, beyond all that a sector's world holds
// Beyond this, comparing all edges costs more than GJK.
constexpr std::size_t kPolyhedronVerticesMax = 32;

Bounds bounds_of_points(const std::vector<Vector>& points) {
  Bounds bounds{points.front(), points.front()};
  for (const Vector& point : points) bounds.extend({point, point});
  return bounds;
}

Bounds around(const Vector& half) { return {-half, half}; }

// m, by how much a corner of a hull is farther from the points of its core than their margin.
Scalar rounded_off_most(const Core& core) {
  Scalar most = 0;
  for (const Vector& corner : core.shape_points) {
    Scalar least = std::numeric_limits<Scalar>::max();
    for (const Vector& point : core.points) least = std::min(least, (point - corner).squaredNorm());
    most = std::max(most, std::sqrt(least) - core.margin);
  }
  return most;
}

const Vector& farthest_of(std::span<const Vector> points, const Vector& direction) {
  return *std::max_element(points.begin(), points.end(), [&](const Vector& x, const Vector& y) {
    return x.dot(direction) < y.dot(direction);
  });
}

Vector unit(const Vector& v) { return v * (1 / std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z())); }

}  // namespace

Vector farthest(const Part& part, const Vector& direction) {
  const Vector& half = part.core.half;
  switch (part.core.kind) {
    case Core::Kind::kPoint:
      return unit(direction) * part.ball.radius;
    case Core::Kind::kSegment: {
      Vector point = unit(direction) * part.capsule.radius;
      point.z() += direction.z() < 0 ? -half.z() : half.z();
      return point;
    }
    case Core::Kind::kBox:
      return {std::copysign(half.x(), direction.x()), std::copysign(half.y(), direction.y()),
              std::copysign(half.z(), direction.z())};
    case Core::Kind::kCylinder: {
      const Scalar side = std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
      const Scalar scale = side > 0 ? half.x() / side : 0;
      return {direction.x() * scale, direction.y() * scale, std::copysign(half.z(), direction.z())};
    }
    case Core::Kind::kEllipsoid: {
      const Vector stretched = direction.cwiseProduct(half);
      return stretched.cwiseProduct(half) / stretched.norm();
    }
    case Core::Kind::kPoints:
      break;
  }
  if (!part.core.shape_points.empty()) return farthest_of(part.core.shape_points, direction);
  return farthest_of(part.core.points, direction) + unit(direction) * part.core.margin;
}

namespace {

// The bounds of the bounds of a part, posed.
Bounds rough_bounds_at(const Part& part, const Frame& body) {
  const Frame at = part.is_placed ? body * part.frame : body;
  switch (part.kind) {
    case Part::Kind::kBall:
      return around(Vector::Constant(part.ball.radius)).moved(at.position);
    case Part::Kind::kPlane: {
      Bounds bounds{Vector::Constant(-kFar), Vector::Constant(kFar)};
      const Vector normal = at.rotation * part.normal;
      for (int axis = 0; axis < 3; ++axis) {
        if (normal[axis] > 1 - Scalar(1e-6)) bounds.high[axis] = at.position[axis] + Scalar(0.1);
        if (normal[axis] < -1 + Scalar(1e-6)) bounds.low[axis] = at.position[axis] - Scalar(0.1);
      }
      return bounds;
    }
    default:
      return part.bounds.posed(at);
  }
}

// m, how far a part reaches along the axes of the world, of one that reaches as far against them.
Vector reach_of(const Part& part, const Matrix& rotation) {
  const Vector along = rotation.col(2).cwiseAbs();
  if (part.kind == Part::Kind::kCapsule)
    return Vector::Constant(part.capsule.radius) + along * part.capsule.half_length;
  const Vector& half = part.bounds.high;
  if (is_cylinder(part)) {
    const Vector across = (Vector::Ones() - along.cwiseProduct(along)).cwiseMax(0);
    return across.cwiseSqrt() * half.x() + along * half.z();
  }
  return (rotation * half.asDiagonal()).rowwise().norm();  // of an ellipsoid
}

}  // namespace

Bounds bounds_at(const Part& part, const Frame& body) {
  const bool is_polyhedron = part.kind == Part::Kind::kPolyhedron;
  const bool is_symmetric = part.kind == Part::Kind::kCapsule || is_cylinder(part) || is_ellipsoid(part);
  if (!is_polyhedron && !is_symmetric) return rough_bounds_at(part, body);
  const Frame at = part.is_placed ? body * part.frame : body;
  if (is_symmetric) return around(reach_of(part, at.rotation)).moved(at.position);
  Bounds bounds = Bounds::nothing();
  for (const Vector& vertex : part.polyhedron->vertices) {
    const Vector place = at.rotation * vertex;
    bounds.extend({place, place});
  }
  return bounds.moved(at.position);
}

namespace {

std::shared_ptr<const Material> material_of(const PartMaterial& given) {
  Material material{Scalar(given.friction), Scalar(given.restitution), given.category, given.mask,
                    std::nullopt};
  if (const Surface& own = given.surface; own != Surface{}) {
    const Eigen::Vector3d direction = Eigen::Vector3d(own.direction.data()).stableNormalized();
    material.surface = {direction.cast<Scalar>(),
                        Scalar(own.second_friction),
                        Scalar(own.torsional_friction),
                        Scalar(own.patch_radius),
                        Scalar(own.rolling_friction),
                        Vector::Zero(),
                        Vector::Zero()};
  }
  return std::make_shared<const Material>(material);
}

}  // namespace
Solid::Hulls Solid::hulls_of(const Shape& shape) {
  Hulls hulls(shape.parts.size());
  for (std::size_t n = 0; n < hulls.size(); ++n) {
    if (const auto* hull = std::get_if<ConvexHull>(&shape.parts[n].geometry)) hulls[n].emplace(*hull);
  }
  return hulls;
}

bullet::CollisionShape Solid::bullet_shape(const Shape& shape, const Pose& centre, bool is_static,
                                           const Hulls& hulls) {
  constexpr auto kUse = bullet::CollisionShape::Use::kCastsAlone;
  const auto is_simplified = [](const std::optional<SolidHull>& hull) { return hull && hull->simplified(); };
  if (std::none_of(hulls.begin(), hulls.end(), is_simplified))
    return bullet::CollisionShape(shape, centre, is_static, kUse);
  Shape simple = shape;
  for (std::size_t n = 0; n < hulls.size(); ++n) {
    if (is_simplified(hulls[n])) simple.parts[n].geometry = *hulls[n]->simplified();
  }
  return bullet::CollisionShape(simple, centre, is_static, kUse);
}

Solid::Solid(const Shape& shape, const Pose& centre, bool is_static)
    : Solid(shape, centre, is_static, hulls_of(shape)) {}

Solid::Solid(const Shape& shape, const Pose& centre, bool is_static, const Hulls& hulls)
    : bullet_(bullet_shape(shape, centre, is_static, hulls)) {
  const bool is_centred = centre.is_identity();
  btCollisionShape* const root = bullet_.root();
  const btTransform& offset = bullet_.offset();
  offset_.position = vector(offset.getOrigin());
  for (int row = 0; row < 3; ++row) offset_.rotation.row(row) = vector(offset.getBasis()[row]).transpose();
  auto* const compound = root->isCompound() ? static_cast<btCompoundShape*>(root) : nullptr;
  for (std::size_t n = 0; n < shape.parts.size(); ++n) {
    const Geometry& geometry = shape.parts[n].geometry;
    Pose pose = is_centred ? shape.parts[n].pose : centre.inverse() * shape.parts[n].pose;
    btCollisionShape* const its = compound ? compound->getChildShape(static_cast<int>(n)) : root;
    // The pose of the only part of a static body is in its offset, or in the points of a hull. Bullet has the
    // middle of a height field at its origin.
    if (!compound && is_static && !std::holds_alternative<ConvexHull>(geometry)) {
      pose = {};
      if (const auto* field = std::get_if<HeightField>(&geometry)) {
        const auto [low, high] = std::minmax_element(field->heights.begin(), field->heights.end());
        pose.position.z() = -double((Scalar(*low) + Scalar(*high)) / 2);
      }
    }
    parts_.push_back(make_part(geometry, pose, its, hulls[n] ? &*hulls[n] : nullptr));
    if (shape.parts[n].material) {
      parts_.back().material = material_of(*shape.parts[n].material);
      has_materials_ = true;
    }
    if (!is_static) add_swept_ball(parts_.back(), Scalar(smallest_extent({{{geometry, pose}}})));
  }
  const double extent = smallest_extent(shape);
  // Surfaces have no extent.
  margin_ = extent > 0 ? std::min(kMarginMax, kMarginShare * Scalar(std::min(extent, 1.0))) : kMarginMax;
  bounds_ = rough_bounds_at(parts_.front(), {});
  for (const Part& part : parts_) bounds_.extend(rough_bounds_at(part, {}));
  extent_ = parts_.size() == 1 ? Scalar(extent) : (bounds_.high - bounds_.low).minCoeff();
  radius_ = bounds_.low.cwiseAbs().cwiseMax(bounds_.high.cwiseAbs()).norm();
  find_swing();
}

void Solid::find_swing() {
  const Part& first = parts_.front();
  const bool is_lone = parts_.size() == 1 && first.frame.position.isZero(0);
  if (is_lone && first.kind == Part::Kind::kBall) return;
  if (is_lone && (first.kind == Part::Kind::kCapsule || is_cylinder(first)))
    round_axis_ = first.frame.rotation.col(2);
  Scalar inner = 0;
  for (const SweptBall& ball : swept_balls_)
    inner = std::max(inner, ball.radius / (2 * kSweptShare) - ball.centre.norm());
  swing_ = std::max(radius_ - inner, Scalar(0));
}

void Solid::add_swept_ball(const Part& part, Scalar extent) {
  if (!part.convex) return;
  Vector middle = Vector::Zero();
  if (part.polyhedron) {
    for (const Vector& vertex : part.polyhedron->vertices) middle += vertex;
    middle /= Scalar(part.polyhedron->vertices.size());
  }
  const auto its = static_cast<std::uint32_t>(&part - parts_.data());
  swept_balls_.push_back({part.frame * middle, extent * kSweptShare, its});
}

void Solid::set_hull(const SolidHull& hull, const Pose& pose, Part& part) {
  part.planes = planes_.emplace_back(hull.planes(pose));
  std::optional<collision::Polyhedron<Scalar>> polyhedron = hull.polyhedron(pose);
  if (!polyhedron) return;
  if (polyhedron->vertices.size() <= kPolyhedronVerticesMax) {
    part.kind = Part::Kind::kPolyhedron;
    part.bounds = bounds_of_points(polyhedron->vertices);
  }
  part.polyhedron =
      polyhedra_.emplace_back(std::make_unique<collision::Polyhedron<Scalar>>(*std::move(polyhedron))).get();
}

void Solid::set_core(const Geometry& geometry, Part& part) {
  Core& core = part.core;
  core.margin = part.convex->getMargin();
  core.half = part.half.cast<Scalar>();
  if (std::holds_alternative<Sphere>(geometry)) {
    core.kind = Core::Kind::kPoint;
    core.margin = part.ball.radius;
  } else if (std::holds_alternative<Capsule>(geometry)) {
    core.kind = Core::Kind::kSegment;
    core.margin = part.capsule.radius;
  } else if (std::holds_alternative<tessera::Box>(geometry)) {
    core.kind = Core::Kind::kBox;
  } else if (std::holds_alternative<Cylinder>(geometry)) {
    core.kind = Core::Kind::kCylinder;
  } else if (std::holds_alternative<Ellipsoid>(geometry)) {
    core.kind = Core::Kind::kEllipsoid;
  } else {
    core.kind = Core::Kind::kPoints;
    const auto* hull = static_cast<const btConvexHullShape*>(part.convex);
    std::vector<Vector>& points = core_points_.emplace_back();
    for (int n = 0; n < hull->getNumPoints(); ++n) points.push_back(vector(hull->getScaledPoint(n)));
    core.points = points;
    core.middle = (part.bounds.low + part.bounds.high) / 2;
    if (!part.polyhedron) return;
    core.shape_points = part.polyhedron->vertices;
    core.rounded_off_most = rounded_off_most(core);
  }
}

Part Solid::make_part(const Geometry& geometry, const Pose& pose, btCollisionShape* bullet,
                      const SolidHull* hull) {
  Part part;
  part.frame = frame(pose);
  part.is_placed = !pose.is_identity();
  if (bullet->isConvex()) part.convex = static_cast<const btConvexShape*>(bullet);
  if (bullet->isConcave()) part.surface = bullet;
  const auto set_round = [&] {
    part.kind = Part::Kind::kRound;
    btVector3 low;
    btVector3 high;
    bullet->getAabb(btTransform::getIdentity(), low, high);
    part.bounds = {vector(low), vector(high)};
  };
  if (const auto* box = std::get_if<tessera::Box>(&geometry)) {
    part.kind = Part::Kind::kBox;
    part.half = box->size / 2;
    part.cuboid.half = part.half.cast<Scalar>();
    part.bounds = around(part.cuboid.half);
  } else if (const auto* sphere = std::get_if<Sphere>(&geometry)) {
    part.kind = Part::Kind::kBall;
    part.ball.radius = Scalar(sphere->radius);
    part.radius = sphere->radius;
    part.bounds = around(Vector::Constant(part.ball.radius));
  } else if (const auto* capsule = std::get_if<Capsule>(&geometry)) {
    part.kind = Part::Kind::kCapsule;
    part.capsule.radius = Scalar(capsule->radius);
    part.capsule.half_length = Scalar(capsule->length / 2);
    part.half = {capsule->radius, capsule->radius, capsule->length / 2};
    part.bounds =
        around({part.capsule.radius, part.capsule.radius, part.capsule.radius + part.capsule.half_length});
  } else if (const auto* plane = std::get_if<Plane>(&geometry)) {
    part.kind = Part::Kind::kPlane;
    part.normal = plane->normal.cast<Scalar>();
    part.bounds = around(Vector::Constant(kFar));
  } else if (hull) {
    set_round();
    // A lone hull has its pose in its points, as in Bullet's form of it.
    const bool is_baked = part.is_placed && bullet == bullet_.root();
    if (is_baked) {
      part.frame = {};
      part.is_placed = false;
    }
    set_hull(*hull, is_baked ? pose : Pose{}, part);
  } else if (const auto* mesh = std::get_if<TriangleMesh>(&geometry)) {
    part.kind = Part::Kind::kTerrain;
    std::vector<Vector> vertices;
    for (const Eigen::Vector3d& vertex : mesh->vertices) vertices.push_back(vertex.cast<Scalar>());
    part.bounds = bounds_of_points(vertices);
    const btOptimizedBvh& tree = *static_cast<btBvhTriangleMeshShape*>(bullet)->getOptimizedBvh();
    part.terrain = terrains_.emplace_back(make_terrain(*mesh, tree)).get();
  } else if (const auto* field = std::get_if<HeightField>(&geometry)) {
    part.kind = Part::Kind::kTerrain;
    const auto [low, high] = std::minmax_element(field->heights.begin(), field->heights.end());
    const Eigen::Vector2d half =
        field->spacing.cwiseProduct(Eigen::Vector2d(field->columns - 1, field->rows - 1)) / 2;
    part.bounds = {Vector(Scalar(-half.x()), Scalar(-half.y()), Scalar(*low)),
                   Vector(Scalar(half.x()), Scalar(half.y()), Scalar(*high))};
    part.terrain = terrains_.emplace_back(make_terrain(*field)).get();
    // Bullet has the middle of the heights at the origin.
    part.surface_origin.z() = double((Scalar(*low) + Scalar(*high)) / 2);
  } else {
    set_round();
    if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) {
      part.half = {cylinder->radius, cylinder->radius, cylinder->length / 2};
    } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry)) {
      part.half = ellipsoid->radii;
    }
  }
  if (part.convex && part.kind != Part::Kind::kPlane) set_core(geometry, part);
  return part;
}

Bounds Solid::bounds_at(const Frame& at) const {
  return parts_.size() == 1 ? native::bounds_at(parts_.front(), at) : bounds_.posed(at);
}

void Solid::parts_near(const Bounds& bounds, std::vector<std::uint32_t>& found) const {
  found.clear();
  if (!bullet_.root()->isCompound()) {
    for (std::uint32_t n = 0; n < parts_.size(); ++n) found.push_back(n);
    return;
  }
  struct Collector final : btDbvt::ICollide {
    explicit Collector(std::vector<std::uint32_t>& f) : found(f) {}
    void Process(const btDbvtNode* leaf) override {
      found.push_back(static_cast<std::uint32_t>(leaf->dataAsInt));
    }
    std::vector<std::uint32_t>& found;
  } collector(found);
  const btDbvt& tree = *static_cast<const btCompoundShape*>(bullet_.root())->getDynamicAabbTree();
  tree.collideTV(tree.m_root, btDbvtVolume::FromMM(bt(bounds.low), bt(bounds.high)), collector);
  std::sort(found.begin(), found.end());
}

}  // namespace tessera::native
