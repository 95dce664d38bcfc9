// Rays. Where bodies and rays are is known in double precision, and so is where they meet, whatever the
// engine computes with.

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>

#include "lpss/collision/ray.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

using collision::Ray;
using collision::RayContact;

// Maps a frame to another, as Frame.
struct ExactFrame {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position;

  explicit ExactFrame(const Frame& f)
      : rotation(f.rotation.cast<double>()), position(f.position.cast<double>()) {}
  Ray inverse(const Ray& ray) const {
    return {rotation.transpose() * (ray.from - position), rotation.transpose() * ray.way, ray.first,
            ray.last};
  }
};

// The pose of a body's solid. The numbers of the engine are a static body's own, rounded.
ExactFrame exact_frame_of(const Body& body) {
  ExactFrame frame(body.pose);
  if (body.static_state) {
    const Eigen::Matrix3d rotation =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(body.static_state->rotation.data());
    const ExactFrame offset(body.solid->offset());
    frame.rotation = rotation * offset.rotation;
    frame.position = Eigen::Vector3d(body.static_state->position.data()) + rotation * offset.position;
  } else if (body.fine) {
    frame.position = body.fine->position;
  }
  return frame;
}

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

  void look_at(const Body& body) {
    const Solid& solid = *body.solid;
    const ExactFrame frame = exact_frame_of(body);
    double moved = 0;
    Ray near = ray_.beside(frame.position, moved);
    // All of the shape is within this.
    const double reach = double(solid.radius()) + double(solid.margin());
    if ((near.from - frame.position).squaredNorm() > reach * reach) return;
    const double most = reach / near.way.norm();
    near.first = std::max(near.first, -most);
    near.last = std::min(near.last, most);
    if (!(near.first <= near.last)) return;
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
  }

  const std::optional<RayHit>& nearest() const { return nearest_; }

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

}  // namespace

std::optional<RayHit> NativeWorld::raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                           std::uint32_t mask) const {
  const Ray ray{from, to - from};
  if (!ray.is_sensible()) return std::nullopt;
  refresh_bounds();
  const Vector start = from.cast<Scalar>();
  const Vector end = to.cast<Scalar>();
  std::vector<BodySlot> near;
  broad_phase_.for_each_in(Bounds{start.cwiseMin(end), start.cwiseMax(end)}, [&](BodySlot slot) {
    const Body& other = body(slot);
    if (other.role != Role::kClone && (other.category & mask) != 0) near.push_back(slot);
  });
  // Of bodies that are met at the same place, the first one counts.
  std::sort(near.begin(), near.end(), [&](BodySlot a, BodySlot b) { return body(a).id < body(b).id; });
  RayAtBodies bodies(ray);
  for (const BodySlot slot : near) bodies.look_at(body(slot));
  return bodies.nearest();
}

}  // namespace tessera::native
