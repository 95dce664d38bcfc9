// Rays. Where bodies and rays are is known in double precision, and so is where they meet, whatever the
// engine computes with.

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>

#include "lpss/collision/ray.h"
#include "lpss/native/exact_frame.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

using collision::Ray;
using collision::RayContact;

Eigen::Vector3d exact(const btVector3& v) { return vector(v).cast<double>(); }

// The nearest of the triangles that Bullet finds along a ray.
class NearestTriangle final : public btTriangleCallback {
 public:
  explicit NearestTriangle(const Ray& ray) : ray_(ray) {}
  void processTriangle(btVector3* corners, int, int) override {
    const std::optional<RayContact> contact =
        meet_triangle(ray_, {exact(corners[0]), exact(corners[1]), exact(corners[2])});
    if (!contact) return;
    nearest = contact;
    ray_.last = contact->t;
  }

  std::optional<RayContact> nearest;

 private:
  Ray ray_;
};

std::optional<RayContact> meet_surface_of(const Part& part, Ray ray) {
  // Where Bullet has the frame of the part.
  ray.from -= part.surface_origin;
  NearestTriangle triangles(ray);
  // Bullet takes edges of boxes for outside: it gets a little more of the ray.
  const double more = 1e-3 * (ray.last - ray.first);
  const btVector3 from = bt(Vector((ray.from + (ray.first - more) * ray.way).cast<Scalar>()));
  const btVector3 to = bt(Vector((ray.from + (ray.last + more) * ray.way).cast<Scalar>()));
  if (auto* field = dynamic_cast<btHeightfieldTerrainShape*>(part.surface)) {
    field->performRaycast(&triangles, from, to);
  } else if (auto* mesh = dynamic_cast<btBvhTriangleMeshShape*>(part.surface)) {
    mesh->performRaycast(&triangles, from, to);
  }
  return triangles.nearest;
}

// In the frame of the part.
std::optional<RayContact> meet_part(const Part& part, const Ray& ray) {
  switch (part.kind) {
    case Part::Kind::kBall:
      return meet_ball(ray, part.radius);
    case Part::Kind::kBox:
      return meet_box(ray, part.half);
    case Part::Kind::kCapsule:
      return meet_capsule(ray, part.half.x(), part.half.z());
    case Part::Kind::kPlane:
      return collision::meet_surface(ray, {part.normal.cast<double>().normalized(), 0});
    case Part::Kind::kTerrain:
      return meet_surface_of(part, ray);
    default:
      break;
  }
  if (!part.planes.empty()) return meet_planes(ray, part.planes);
  if (is_cylinder(part)) return meet_cylinder(ray, part.half.x(), part.half.z());
  return meet_ellipsoid(ray, part.half);
}

class RayAtBodies {
 public:
  explicit RayAtBodies(const Ray& ray) : ray_(ray) {}

  // Of the body; nothing where it is not met nearer than `limit`, as a fraction.
  std::optional<RayHit> look_at(const Body& body, double limit) {
    nearest_.reset();
    const Solid& solid = *body.solid;
    const ExactFrame frame = exact_frame_of(body);
    double moved = 0;
    Ray near = ray_.beside(frame.position, moved);
    // All of the shape is within this.
    const double reach = double(solid.radius()) + double(solid.margin());
    if ((near.from - frame.position).squaredNorm() > reach * reach) return std::nullopt;
    const double most = reach / near.way.norm();
    near.first = std::max(near.first, -most);
    near.last = std::min(near.last, most);
    if (!(near.first <= near.last) || near.first + moved > limit) return std::nullopt;
    const Ray in_body = frame.inverse(near);
    find_parts(solid, in_body);
    for (const std::uint32_t n : parts_) {
      const Part& part = solid.parts()[n];
      if (!part.is_placed) {
        take(body, meet_part(part, in_body), frame.rotation, moved);
      } else {
        const ExactFrame place(part.frame);
        double more = 0;
        const Ray in_part = place.inverse(in_body).beside(Eigen::Vector3d::Zero(), more);
        take(body, meet_part(part, in_part), frame.rotation * place.rotation, moved + more);
      }
    }
    return nearest_ && nearest_->fraction < limit ? nearest_ : std::nullopt;
  }

 private:
  void find_parts(const Solid& solid, const Ray& ray) {
    const auto at = [&](double t) { return Vector((ray.from + t * ray.way).cast<Scalar>()); };
    const Vector first = at(ray.first);
    const Vector last = at(ray.last);
    solid.parts_near(Bounds{first.cwiseMin(last), first.cwiseMax(last)}.grown(solid.margin()), parts_);
  }

  void take(const Body& body, const std::optional<RayContact>& contact, const Eigen::Matrix3d& rotation,
            double moved) {
    if (!contact) return;
    const double fraction = std::clamp(contact->t + moved, 0., 1.);
    if (nearest_ && nearest_->fraction <= fraction) return;
    nearest_ = RayHit{body.id, fraction, (rotation * contact->normal).normalized()};
  }

  Ray ray_;
  std::vector<std::uint32_t> parts_;
  std::optional<RayHit> nearest_;
};

// More than any fraction.
constexpr double kNoLimit = 2;

}  // namespace

std::optional<RayHit> NativeWorld::raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                           const QueryFilter& filter) const {
  const Ray ray{from, to - from};
  if (!ray.is_sensible()) return std::nullopt;
  RayAtBodies bodies(ray);
  std::optional<RayHit> nearest;
  // Of bodies that are met at the same place, the first one counts.
  for (const BodySlot slot : bodies_along({from, to}, filter)) {
    const std::optional<RayHit> hit = bodies.look_at(body(slot), nearest ? nearest->fraction : kNoLimit);
    if (hit) nearest = hit;
  }
  return nearest;
}

std::vector<RayHit> NativeWorld::raycast_all(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             const QueryFilter& filter) const {
  const Ray ray{from, to - from};
  std::vector<RayHit> hits;
  if (!ray.is_sensible()) return hits;
  RayAtBodies bodies(ray);
  for (const BodySlot slot : bodies_along({from, to}, filter)) {
    if (const std::optional<RayHit> hit = bodies.look_at(body(slot), kNoLimit)) hits.push_back(*hit);
  }
  return hits;
}

}  // namespace tessera::native
