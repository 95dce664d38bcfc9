// Probes that go along a line until they touch something. In double precision, as rays.

#include <algorithm>
#include <cmath>
#include <variant>

#include "lpss/collision/sweep.h"
#include "lpss/native/exact_frame.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

using collision::SweepContact;
using collision::SweepWay;
using ExactCore = collision::Core<double>;
using ExactPoints = std::vector<Eigen::Vector3d>;

// m: contacts that are no farther apart come at the same time.
constexpr double kSameTime = 1e-6;
// m, of boxes.
constexpr Scalar kBoxRounding = Scalar(1e-3);

// A convex shape of which nothing is rounded off.
class ExactShape {
 public:
  // Not convex: nothing of it touches anything.
  explicit ExactShape(const Geometry& geometry) {
    if (const auto* box = std::get_if<tessera::Box>(&geometry)) {
      core_ = {.kind = ExactCore::Kind::kBox, .half = box->size / 2};
    } else if (const auto* sphere = std::get_if<Sphere>(&geometry)) {
      core_ = {.kind = ExactCore::Kind::kPoint, .margin = sphere->radius};
    } else if (const auto* capsule = std::get_if<Capsule>(&geometry)) {
      core_ = {
          .kind = ExactCore::Kind::kSegment, .half = {0, 0, capsule->length / 2}, .margin = capsule->radius};
    } else if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) {
      core_ = {.kind = ExactCore::Kind::kCylinder,
               .half = {cylinder->radius, cylinder->radius, cylinder->length / 2}};
    } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry)) {
      core_ = {.kind = ExactCore::Kind::kEllipsoid, .half = ellipsoid->radii};
    } else if (const auto* hull = std::get_if<ConvexHull>(&geometry)) {
      set_points(hull->points, 0);
    } else {
      is_convex_ = false;
    }
  }

  // Of a part that is convex, and no plane.
  explicit ExactShape(const Part& part) : core_{.half = part.half} {
    using Kind = collision::Core<Scalar>::Kind;
    switch (part.core.kind) {
      case Kind::kPoint:
        core_ = {.kind = ExactCore::Kind::kPoint, .margin = part.radius};
        return;
      case Kind::kSegment:
        core_ = {.kind = ExactCore::Kind::kSegment, .half = {0, 0, part.half.z()}, .margin = part.half.x()};
        return;
      case Kind::kBox:
        core_.kind = ExactCore::Kind::kBox;
        return;
      case Kind::kCylinder:
        core_.kind = ExactCore::Kind::kCylinder;
        return;
      case Kind::kEllipsoid:
        core_.kind = ExactCore::Kind::kEllipsoid;
        return;
      case Kind::kPoints:
        break;
    }
    const bool has_corners = !part.core.shape_points.empty();
    const auto corners = has_corners ? part.core.shape_points : part.core.points;
    ExactPoints points;
    for (const Vector& corner : corners) points.push_back(corner.cast<double>());
    set_points(std::move(points), has_corners ? 0 : double(part.core.margin));
  }

  explicit ExactShape(const MeshTriangle<Scalar>& triangle) {
    ExactPoints corners;
    for (const Vector& corner : triangle.vertex) corners.push_back(corner.cast<double>());
    set_points(std::move(corners), 0);
  }

  ExactShape(const ExactShape&) = delete;
  ExactShape& operator=(const ExactShape&) = delete;

  bool is_convex() const { return is_convex_; }
  const ExactCore& core() const { return core_; }

  // The point that is farthest along `direction`, of the shape turned by `rotation` around the origin.
  Eigen::Vector3d farthest(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& direction) const {
    const collision::PlacedCore<double> placed(core_, rotation, Eigen::Vector3d::Zero());
    return placed.support(direction) + direction.normalized() * core_.margin;
  }

 private:
  void set_points(ExactPoints points, double margin) {
    points_ = std::move(points);
    core_ = {.kind = ExactCore::Kind::kPoints, .margin = margin, .points = points_};
    core_.middle.setZero();
    for (const Eigen::Vector3d& point : points_) core_.middle += point / double(points_.size());
  }

  ExactCore core_;
  ExactPoints points_;
  bool is_convex_ = true;
};

class MovingProbe {
 public:
  MovingProbe(const Geometry& geometry, const Pose& pose, const SweepWay& way)
      : shape_(geometry),
        rotation_(pose.orientation.normalized().toRotationMatrix()),
        from_(pose.position),
        way_(way) {
    for (int k = 0; k < 3 && shape_.is_convex(); ++k) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      low_[k] = axis.dot(shape_.farthest(rotation_, -axis));
      high_[k] = axis.dot(shape_.farthest(rotation_, axis));
    }
  }

  bool is_sensible() const {
    return shape_.is_convex() && from_.allFinite() && way_.direction.allFinite() && way_.length >= 0 &&
           std::isfinite(way_.length) && low_.allFinite() && high_.allFinite();
  }

  // Of its box.
  BoxOnWay box() const {
    const Eigen::Vector3d start = from_ + (low_ + high_) / 2;
    return {start, start + way_.direction * way_.length, (high_ - low_) / 2};
  }

  void look_at(const Body& body) {
    contact_.reset();
    const ExactFrame frame = exact_frame_of(body);
    body.solid->parts_near(bounds_from(frame, 0, way_.length).grown(kBoxRounding), parts_);
    for (const std::uint32_t n : parts_) {
      const Part& part = body.solid->parts()[n];
      meet(part, part.is_placed ? frame * ExactFrame(part.frame) : frame);
    }
    if (!contact_ || (hit_ && hit_->distance <= contact_->distance)) return;
    hit_ = ProbeHit{body.id, contact_->distance, contact_->normal.normalized()};
  }

  const std::optional<ProbeHit>& hit() const { return hit_; }

 private:
  // The box around its way from `first` to `last` (m), as seen from a frame.
  Bounds bounds_from(const ExactFrame& frame, double first, double last) const {
    const Eigen::Vector3d middle = from_ + (low_ + high_) / 2;
    const Eigen::Vector3d start = frame.inverse(Eigen::Vector3d(middle + way_.direction * first));
    const Eigen::Vector3d end = frame.inverse(Eigen::Vector3d(middle + way_.direction * last));
    const Eigen::Vector3d half = frame.rotation.transpose().cwiseAbs() * ((high_ - low_) / 2);
    return {Eigen::Vector3d(start.cwiseMin(end) - half).cast<Scalar>(),
            Eigen::Vector3d(start.cwiseMax(end) + half).cast<Scalar>()};
  }

  void meet(const Part& part, const ExactFrame& frame) {
    if (part.kind == Part::Kind::kPlane) {
      const Eigen::Vector3d up = (frame.rotation * part.normal.cast<double>()).normalized();
      const double gap = up.dot(from_ + shape_.farthest(rotation_, -up) - frame.position);
      return take(sweep_at_plane(gap, up, limited()));
    }
    if (part.kind == Part::Kind::kTerrain) return meet_terrain(part, frame);
    meet(ExactShape(part), frame, limited());
  }

  void meet(const ExactShape& shape, const ExactFrame& frame, const SweepWay& way) {
    take(collision::sweep(shape_.core(), shape.core(), {rotation_, frame.rotation, frame.position - from_},
                          way));
  }

  // Piece by piece, since the box around all of a long way holds triangles that are far from it.
  void meet_terrain(const Part& part, const ExactFrame& frame) {
    constexpr int kPiecesMax = 64;
    constexpr double kPieceMin = 1;  // m
    const double length = std::max({kPieceMin, 2 * (high_ - low_).maxCoeff(), way_.length / kPiecesMax});
    for (double first = 0; first < limited().length || first == 0; first += length) {
      const double last = std::min(first + length, way_.length);
      const Bounds bounds = bounds_from(frame, first, last).grown(kBoxRounding);
      if (!bounds.overlaps(part.bounds)) continue;
      Terrain::List triangles;
      part.terrain->near(bounds, triangles);
      for (const Terrain::Found& found : triangles)
        meet(ExactShape(found.triangle), frame, {way_.direction, std::min(last, limited().length)});
    }
  }

  // Of the way, what may still matter.
  SweepWay limited() const {
    double length = way_.length;
    if (hit_) length = std::min(length, hit_->distance);
    if (contact_) length = std::min(length, contact_->distance + kSameTime);
    return {way_.direction, length};
  }

  // Of contacts at the same time, the one that is met most directly: where faces meet in an edge, others say
  // less.
  void take(const std::optional<SweepContact>& contact) {
    if (!contact) return;
    if (!contact_ || contact->distance < contact_->distance - kSameTime) {
      contact_ = contact;
      return;
    }
    if (contact->distance > contact_->distance + kSameTime) return;
    const bool is_more_direct = way_.direction.dot(contact->normal - contact_->normal) < -kSameTime;
    if (is_more_direct) contact_->normal = contact->normal;
    contact_->distance = std::min(contact_->distance, contact->distance);
  }

  ExactShape shape_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d from_;
  SweepWay way_;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();  // m, of its box, from its origin
  Eigen::Vector3d high_ = Eigen::Vector3d::Zero();
  std::vector<std::uint32_t> parts_;
  std::optional<SweepContact> contact_;  // of the body that is looked at
  std::optional<ProbeHit> hit_;
};

}  // namespace

std::vector<BodySlot> NativeWorld::bodies_along(const BoxOnWay& way, const QueryFilter& filter) const {
  refresh_bounds();
  std::vector<BodySlot> near;
  broad_phase_.for_each_along(way, [&](BodySlot slot) {
    const Body& other = body(slot);
    if (other.role != Role::kClone && filter.wants(other.id, other.category)) near.push_back(slot);
  });
  std::sort(near.begin(), near.end(), [&](BodySlot a, BodySlot b) { return body(a).id < body(b).id; });
  return near;
}

std::optional<ProbeHit> NativeWorld::sweep(const Geometry& geometry, const Pose& pose,
                                           const Eigen::Vector3d& direction, double length,
                                           const QueryFilter& filter) const {
  MovingProbe probe(geometry, pose, {direction, length});
  if (!probe.is_sensible()) return std::nullopt;
  for (const BodySlot slot : bodies_along(probe.box(), filter)) probe.look_at(body(slot));
  return probe.hit();
}

}  // namespace tessera::native
