#include "coordinator/set_state.h"

#include <absl/container/btree_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "proto/convert.h"

namespace tessera {
namespace {

constexpr double kTurnMax = 1e6;  // rad

// A body in its centre frame, relative to the centre of a sector that is near.
struct Placed {
  SectorIndex origin;
  JointSide side;
};

class PlacedBodies {
 public:
  PlacedBodies(const WorldRegistry& world, bool keeps_contacts)
      : world_(world), keeps_contacts_(keeps_contacts) {}

  absl::Status place(const v1::SetState::OfBody& given) {
    const absl::StatusOr<BodyId> id = world_.resolve(given.body());
    if (!id.ok()) return id.status();
    const WorldRegistry::Entry& entry = *world_.find(*id);
    const std::string title = absl::StrCat("body '", entry.name, "'");
    if (!given.has_pose()) return refused(title, ": pose must be set");
    BodyDescription body;
    body.name = entry.name;
    body.properties = entry.properties;
    body.pose = from_proto(given.pose());
    body.linear_velocity = from_proto(given.linear_velocity());
    body.angular_velocity = from_proto(given.angular_velocity());
    const Shape& shape = *world_.shapes().find(entry.properties.shape);
    if (absl::Status status = validate(body, shape, world_.settings()); !status.ok()) return status;
    const absl::StatusOr<BodyRecord> record = record_of(body, world_.settings());
    if (!record.ok()) return record.status();
    if (absl::Status status = carrier_home(record->home, *id, world_.settings()); !status.ok())
      return in(title, status);
    return land(*id, title, {record->home, side_of(record->state)});
  }

  // False where it is not known yet where the parent is.
  absl::StatusOr<bool> place(const v1::SetState::OfJoint& given) {
    const absl::StatusOr<JointId> id = world_.joints().resolve(given.joint());
    if (!id.ok()) return id.status();
    const JointRegistry::Entry& joint = *world_.joints().find(*id);
    const JointProperties& properties = joint.record.properties;
    Placed parent{properties.anchor, {}};
    if (properties.parent.value != 0) {
      const auto found = placed_.find(properties.parent);
      if (found == placed_.end()) return false;
      parent = found->second;
    }
    const std::string title = absl::StrCat("joint '", joint.name, "'");
    const absl::StatusOr<JointPlace> place = read(given, properties);
    if (!place.ok()) return in(title, place.status());
    const absl::Status landed =
        land(properties.child, title, {parent.origin, placed_child(properties, parent.side, *place)});
    if (!landed.ok()) return landed;
    return true;
  }

  std::vector<Command> take() { return std::move(commands_); }

 private:
  absl::StatusOr<JointPlace> read(const v1::SetState::OfJoint& given,
                                  const JointProperties& properties) const {
    const std::span<const JointAxis> axes = axes_of(properties);
    const int count = static_cast<int>(axes.size());
    if (given.positions_size() > count)
      return refused(given.positions_size(), " positions must be at most ", count);
    if (given.rates_size() > count) return refused(given.rates_size(), " rates must be at most ", count);
    const bool is_way = properties.type == JointType::kPrismatic;
    const double rate_max = is_way ? kSpeedMax : kAngularSpeedMax;
    JointPlace place;
    for (int n = 0; n < count; ++n) {
      const JointAxis& axis = axes[n];
      const double free = is_way ? world_.settings().sector_size : kTurnMax;
      if (n < given.positions_size()) place.position[n] = given.positions(n);
      if (n < given.rates_size()) place.velocity[n] = given.rates(n);
      if (absl::Status status = bounded(absl::StrCat("position ", n), place.position[n],
                                        std::max(axis.lower, -free), std::min(axis.upper, free));
          !status.ok())
        return status;
      if (absl::Status status = bounded(absl::StrCat("rate ", n), place.velocity[n], -rate_max, rate_max);
          !status.ok())
        return status;
    }
    if (!given.has_orientation()) return place;
    if (properties.type != JointType::kBall) return refused("only a ball joint takes an orientation");
    const v1::Quaternion& q = given.orientation();
    place.ball = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z());
    if (absl::Status status = unit_quaternion("orientation", place.ball); !status.ok()) return status;
    place.ball.normalize();
    return place;
  }

  absl::Status land(BodyId id, const std::string& title, const Placed& placed) {
    if (!placed_.emplace(id, placed).second)
      return refused(title, ": '", world_.find(id)->name, "' is placed twice");
    const JointSide& side = placed.side;
    const absl::StatusOr<WorldPosition> place =
        canonical(placed.origin, side.pose.position, world_.settings().sector_size);
    if (!place.ok()) return in(title, place.status());
    if (absl::Status status = finite("linear velocity", side.linear_velocity, kSpeedMax, "m/s"); !status.ok())
      return in(title, status);
    if (absl::Status status = finite("angular velocity", side.angular_velocity, kAngularSpeedMax, "rad/s");
        !status.ok())
      return in(title, status);
    Teleport jump{id, place->sector, {}};
    jump.keeps_contacts = keeps_contacts_;
    Eigen::Map<Eigen::Vector3d>(jump.state.position.data()) = place->local;
    jump.state.rotation = rotation_of(side.pose.orientation);
    Eigen::Map<Eigen::Vector3d>(jump.state.linear_velocity.data()) = side.linear_velocity;
    Eigen::Map<Eigen::Vector3d>(jump.state.angular_velocity.data()) = side.angular_velocity;
    commands_.push_back(jump);
    return absl::OkStatus();
  }

  const WorldRegistry& world_;
  const bool keeps_contacts_;
  absl::btree_map<BodyId, Placed> placed_;
  std::vector<Command> commands_;
};

}  // namespace

absl::StatusOr<std::vector<Command>> checked(const v1::SetState& command, const WorldRegistry& world) {
  if (command.bodies().empty() && command.joints().empty()) return refused("it must name a body or a joint");
  PlacedBodies placed(world, command.keeps_contacts());
  for (const v1::SetState::OfBody& body : command.bodies()) {
    if (absl::Status status = placed.place(body); !status.ok()) return status;
  }
  // Joints come in any order: each pass places those whose parents it finds.
  std::vector<const v1::SetState::OfJoint*> waiting;
  for (const v1::SetState::OfJoint& joint : command.joints()) waiting.push_back(&joint);
  while (!waiting.empty()) {
    std::vector<const v1::SetState::OfJoint*> later;
    for (const v1::SetState::OfJoint* joint : waiting) {
      const absl::StatusOr<bool> is_placed = placed.place(*joint);
      if (!is_placed.ok()) return is_placed.status();
      if (!*is_placed) later.push_back(joint);
    }
    if (later.size() == waiting.size()) {
      const JointId id = *world.joints().resolve(later.front()->joint());
      const JointRegistry::Entry& joint = *world.joints().find(id);
      return refused("joint '", joint.name, "': its parent '",
                     world.find(joint.record.properties.parent)->name, "' must be placed, too");
    }
    waiting = std::move(later);
  }
  return placed.take();
}

}  // namespace tessera
