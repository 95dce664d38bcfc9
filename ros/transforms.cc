#include "ros/transforms.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "lpss/model/frame_motion.h"
#include "ros/node.h"

namespace tessera::ros {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;

bool is_at(const WorldPose& a, const WorldPose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

Time time_at(Tick tick, double time_step) {
  constexpr std::int32_t kSecondsMax = std::numeric_limits<std::int32_t>::max();
  const double time = static_cast<double>(tick) * time_step;
  if (time >= kSecondsMax) return {kSecondsMax, 0};
  const double seconds = std::floor(time);
  const std::int64_t nanoseconds = std::llround((time - seconds) * kNanoseconds);
  return {static_cast<std::int32_t>(seconds) + static_cast<std::int32_t>(nanoseconds / kNanoseconds),
          static_cast<std::uint32_t>(nanoseconds % kNanoseconds)};
}

std::string frame_name(absl::string_view body_name, absl::string_view root) {
  if (!root.empty()) absl::ConsumePrefix(&body_name, absl::StrCat(root, "::"));
  return absl::StrReplaceAll(body_name, {{"::", "/"}});
}

Transforms::Transforms(std::string parent, const SectorIndex& sector, const WorldSettings& settings,
                       std::string root)
    : parent_(std::move(parent)), root_(std::move(root)), sector_(sector), settings_(settings) {}

void Transforms::name(BodyId id, absl::string_view body_name) {
  names_.try_emplace(id, frame_name(body_name, root_));
}

std::vector<TransformStamped> Transforms::all(const BodyFrame& frame) const {
  const Time stamp = time_at(frame.tick, settings_.time_step);
  const SeenCarriers carriers = carriers_in(frame);
  std::vector<TransformStamped> transforms;
  for (const BodySample& body : frame.bodies) {
    if (has_name(body.id))
      transforms.push_back(transform(body.id, pose_of(body, frame.tick, carriers), stamp));
  }
  return transforms;
}

std::vector<TransformStamped> Transforms::changed(const BodyFrame& frame) {
  const Time stamp = time_at(frame.tick, settings_.time_step);
  const SeenCarriers carriers = carriers_in(frame);
  std::vector<TransformStamped> transforms;
  Poses poses;
  for (const BodySample& body : frame.bodies) {
    if (!has_name(body.id)) continue;
    const WorldPose pose = pose_of(body, frame.tick, carriers);
    const auto last = last_.find(body.id);
    if (last == last_.end() || !is_at(last->second, pose))
      transforms.push_back(transform(body.id, pose, stamp));
    poses.emplace(body.id, pose);
  }
  last_ = std::move(poses);
  return transforms;
}

std::vector<TransformStamped> Transforms::fixed(const std::vector<FoundFrame>& frames, Tick tick) {
  const Time stamp = time_at(tick, settings_.time_step);
  fixed_names_.clear();
  for (const FoundFrame& frame : frames)
    fixed_names_.emplace_back(frame_name(frame.body_name, root_), frame_name(frame.name, root_));
  std::vector<TransformStamped> transforms;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    const auto& [parent, child] = fixed_names_[n];
    const Eigen::Vector3d& position = frames[n].pose.position;
    const Eigen::Quaterniond& orientation = frames[n].pose.orientation;
    transforms.push_back(
        {.header = {.stamp = stamp, .frame_id = text(parent)},
         .child_frame_id = text(child),
         .transform = {.translation = {position.x(), position.y(), position.z()},
                       .rotation = {orientation.x(), orientation.y(), orientation.z(), orientation.w()}}});
  }
  return transforms;
}

SeenCarriers Transforms::carriers_in(const BodyFrame& frame) const {
  SeenCarriers carriers(settings_);
  for (const BodySample& body : frame.bodies) carriers.see(body.id, body.pose);
  return carriers;
}

WorldPose Transforms::pose_of(const BodySample& body, Tick tick, const SeenCarriers& carriers) const {
  if (body.pose.position.sector.frame == sector_.frame) return body.pose;
  const double time = static_cast<double>(tick) * settings_.time_step;
  return pose_in_frame(settings_, time, body.pose, sector_.frame, carriers.poses()).value_or(body.pose);
}

TransformStamped Transforms::transform(BodyId body, const WorldPose& pose, const Time& stamp) const {
  const Eigen::Vector3d position = relative_to(pose.position, sector_, settings_.sector_size);
  const Eigen::Quaterniond& orientation = pose.orientation;
  return {.header = {.stamp = stamp, .frame_id = text(parent_)},
          .child_frame_id = text(names_.at(body)),
          .transform = {.translation = {position.x(), position.y(), position.z()},
                        .rotation = {orientation.x(), orientation.y(), orientation.z(), orientation.w()}}};
}

}  // namespace tessera::ros
