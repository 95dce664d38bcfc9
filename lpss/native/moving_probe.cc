#include "lpss/native/moving_probe.h"

#include <algorithm>
#include <cmath>

namespace tessera::native {
namespace {

using collision::SweepContact;
using collision::SweepWay;

// m: contacts that are no farther apart come at the same time.
constexpr double kSameTime = 1e-6;
// m, of boxes.
constexpr Scalar kBoxRounding = Scalar(1e-3);

}  // namespace

MovingProbe::MovingProbe(const Geometry& geometry, const Pose& pose, const SweepWay& way)
    : shape_(geometry),
      rotation_(pose.orientation.normalized().toRotationMatrix()),
      from_(pose.position),
      way_(way) {
  measure();
}

MovingProbe::MovingProbe(const Part& part, const ExactFrame& at, const SweepWay& way)
    : shape_(part), rotation_(at.rotation), from_(at.position), way_(way) {
  measure();
}

void MovingProbe::measure() {
  for (int k = 0; k < 3 && shape_.is_convex(); ++k) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
    low_[k] = axis.dot(shape_.farthest(rotation_, -axis));
    high_[k] = axis.dot(shape_.farthest(rotation_, axis));
  }
}

bool MovingProbe::is_sensible() const {
  return shape_.is_convex() && from_.allFinite() && way_.direction.allFinite() && way_.length >= 0 &&
         std::isfinite(way_.length) && low_.allFinite() && high_.allFinite();
}

BoxOnWay MovingProbe::box() const {
  const Eigen::Vector3d start = from_ + (low_ + high_) / 2;
  return {start, start + way_.direction * way_.length, (high_ - low_) / 2};
}

void MovingProbe::look_at(const Body& body) {
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

bool MovingProbe::meets(const Part& part, const ExactFrame& at) {
  contact_.reset();
  meet(part, at);
  return contact_.has_value();
}

Bounds MovingProbe::bounds_from(const ExactFrame& frame, double first, double last) const {
  const Eigen::Vector3d middle = from_ + (low_ + high_) / 2;
  const Eigen::Vector3d start = frame.inverse(Eigen::Vector3d(middle + way_.direction * first));
  const Eigen::Vector3d end = frame.inverse(Eigen::Vector3d(middle + way_.direction * last));
  const Eigen::Vector3d half = frame.rotation.transpose().cwiseAbs() * ((high_ - low_) / 2);
  return {Eigen::Vector3d(start.cwiseMin(end) - half).cast<Scalar>(),
          Eigen::Vector3d(start.cwiseMax(end) + half).cast<Scalar>()};
}

void MovingProbe::meet(const Part& part, const ExactFrame& frame) {
  if (part.kind == Part::Kind::kPlane) {
    const Eigen::Vector3d up = (frame.rotation * part.normal.cast<double>()).normalized();
    const double gap = up.dot(from_ + shape_.farthest(rotation_, -up) - frame.position);
    return take(sweep_at_plane(gap, up, limited()));
  }
  if (part.kind == Part::Kind::kTerrain) return meet_terrain(part, frame);
  meet(ExactShape(part), frame, limited());
}

void MovingProbe::meet(const ExactShape& shape, const ExactFrame& frame, const SweepWay& way) {
  take(collision::sweep(shape_.core(), shape.core(), {rotation_, frame.rotation, frame.position - from_},
                        way));
}

// Piece by piece, since the box around all of a long way holds triangles that are far from it.
void MovingProbe::meet_terrain(const Part& part, const ExactFrame& frame) {
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

SweepWay MovingProbe::limited() const {
  double length = way_.length;
  if (hit_) length = std::min(length, hit_->distance);
  if (contact_) length = std::min(length, contact_->distance + kSameTime);
  return {way_.direction, length};
}

// Of contacts at the same time, the one that is met most directly: where faces meet in an edge, others say
// less.
void MovingProbe::take(const std::optional<SweepContact>& contact) {
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

}  // namespace tessera::native
