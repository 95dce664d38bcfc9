#include "lpss/model/world_description.h"

#include <absl/strings/str_cat.h>

#include "lpss/model/checks.h"

namespace tessera {

absl::Status move_by(WorldDescription& world, const SectorOffset& offset) {
  const absl::StatusOr<SectorIndex> anchor = translated(world.anchor, offset);
  if (!anchor.ok()) return in("the world's anchor", anchor.status());

  CentralGravity* planet = std::get_if<CentralGravity>(&world.settings.gravity);
  absl::StatusOr<SectorIndex> planet_sector = SectorIndex{};
  if (planet != nullptr) {
    planet_sector = translated(planet->centre.sector, offset);
    if (!planet_sector.ok()) return in("the centre of central gravity", planet_sector.status());
  }
  // What is in them goes with them.
  const auto moves = [](const SectorIndex& sector) { return sector.frame == kWorldFrame; };
  for (const MovingFrame& frame : world.settings.frames) {
    if (!moves(frame.start.position.sector)) continue;
    const absl::StatusOr<SectorIndex> moved = translated(frame.start.position.sector, offset);
    if (!moved.ok()) return in(absl::StrCat("frame '", frame.name, "'"), moved.status());
  }
  for (const BodyDescription& body : world.bodies) {
    if (!moves(body.pose.position.sector)) continue;
    const absl::StatusOr<SectorIndex> moved = translated(body.pose.position.sector, offset);
    if (!moved.ok()) return in(absl::StrCat("body '", body.name, "'"), moved.status());
  }
  for (const JointDescription& joint : world.joints) {
    if (joint.properties.parent.value != 0 || !moves(joint.properties.anchor)) continue;
    const absl::StatusOr<SectorIndex> moved = translated(joint.properties.anchor, offset);
    if (!moved.ok()) return in(absl::StrCat("joint '", joint.name, "'"), moved.status());
  }

  world.anchor = *anchor;
  if (planet != nullptr) planet->centre.sector = *planet_sector;
  for (MovingFrame& frame : world.settings.frames) {
    if (!moves(frame.start.position.sector)) continue;
    frame.start.position.sector = *translated(frame.start.position.sector, offset);
  }
  for (BodyDescription& body : world.bodies) {
    if (!moves(body.pose.position.sector)) continue;
    body.pose.position.sector = *translated(body.pose.position.sector, offset);
  }
  for (JointDescription& joint : world.joints) {
    if (joint.properties.parent.value != 0 || !moves(joint.properties.anchor)) continue;
    joint.properties.anchor = *translated(joint.properties.anchor, offset);
  }
  return absl::OkStatus();
}

void place_carried(WorldDescription& world) {
  std::vector<MovingFrame>& frames = world.settings.frames;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    MovingFrame& frame = frames[n];
    if (!frame.carrier || frame.carrier->body.value - 1 >= world.bodies.size()) continue;
    const BodyDescription& body = world.bodies[frame.carrier->body.value - 1];
    if (body.pose.position.sector.frame > n) continue;  // not one before it, which validate() refuses
    const absl::StatusOr<WorldPose> start =
        compose(body.pose, frame.carrier->pose, world.settings.sector_size);
    if (!start.ok()) continue;
    frame.start = *start;
    frame.spin = body.angular_velocity;
    const Eigen::Vector3d lever =
        body.pose.orientation * (frame.carrier->pose.position - centre_frame(body.properties).position);
    frame.velocity = body.linear_velocity + frame.spin.cross(lever);
  }
}

}  // namespace tessera
