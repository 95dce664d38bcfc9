#include "lpss/snapshot/record_checks.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <variant>

#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

// Rotations of a simulation are orthonormal to within rounding.
constexpr double kRotationTolerance = 1e-2;

absl::Status are_finite(const std::string& what, const std::array<double, 3>& value) {
  return finite(what, Eigen::Vector3d(value.data()));
}

// Whether all numbers of a command are finite.
struct FiniteNumbers {
  bool all = true;

  void operator()(const auto&... fields) { (look_at(fields), ...); }

  void look_at(double number) { all = all && std::isfinite(number); }
  template <std::size_t N>
  void look_at(const std::array<double, N>& numbers) {
    for (const double number : numbers) look_at(number);
  }
  template <typename T>
  void look_at(const std::optional<T>& item) {
    if (item) look_at(*item);
  }
  void look_at(const Wrench& wrench) { (*this)(wrench.force, wrench.torque); }
  void look_at(const LastingForce& lasting) { look_at(lasting.wrench); }
  void look_at(const std::vector<std::pair<std::uint32_t, double>>& numbers) {
    for (const auto& [place, number] : numbers) look_at(number);
  }
  void look_at(const BodyId&) {}
  void look_at(std::uint32_t) {}
};

absl::Status first_error(std::initializer_list<absl::Status> checks) {
  for (const absl::Status& status : checks) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

RecordChecks checks_of(const Partition& partition) {
  return {partition.settings, [&partition](ShapeId id) -> const Shape* {
            const auto found = partition.shapes.find(id);
            return found == partition.shapes.end() ? nullptr : found->second.get();
          }};
}

absl::Status check_ties(std::span<const JointTie> ties) {
  for (const JointTie& tie : ties) {
    if (tie.id.value == 0 || tie.child.value == 0)
      return refused("the ids of a joint and of its child must be at least 1");
  }
  return absl::OkStatus();
}

// Of a body that is static or lives here.
std::optional<BodyProperties> properties_of(const Partition& partition, BodyId id) {
  if (const BodyRecord* const body = partition.statics.find(id)) return body->properties;
  const auto body = partition.bodies.find(id);
  if (body != partition.bodies.end()) return body->second->properties;
  const std::optional<BodyRecord> packed = partition.packed.body(id);
  return packed ? std::optional(packed->properties) : std::nullopt;
}

// Whether a body may have other properties from now on.
absl::Status check_change(BodyId id, const BodyProperties& now, const BodyProperties& next) {
  const bool stays = now.shape == next.shape && now.centre == next.centre &&
                     now.principal_axes == next.principal_axes && now.assembly == next.assembly;
  if (!stays) return refused(title_of(id), ": its shape, centre frame and assembly must stay as they are");
  if ((now.motion == Motion::kStatic) == (next.motion == Motion::kStatic)) return absl::OkStatus();
  return refused(title_of(id), ": a body that is ", name_of(now.motion), " must not become ",
                 name_of(next.motion));
}

}  // namespace

std::string title_of(BodyId id) { return absl::StrCat("body ", id.value); }

absl::Status RecordChecks::id(BodyId id) const {
  const std::uint64_t last = body_id_max(settings_.seams);
  if (id.value >= 1 && id.value <= last) return absl::OkStatus();
  return refused(title_of(id), ": the id must be 1 to ", last);
}

absl::Status RecordChecks::properties(BodyId body, const BodyProperties& properties) const {
  if (absl::Status status = id(body); !status.ok()) return status;
  const Shape* shape = find_shape_(properties.shape);
  if (shape == nullptr) return refused(title_of(body), ": there is no shape ", properties.shape);
  BodyDescription description;
  description.name = title_of(body);
  description.properties = properties;
  return validate(description, *shape, settings_);
}

absl::Status RecordChecks::home(const SectorIndex& home) const { return known_frame(home, settings_); }

absl::Status RecordChecks::near(const std::string& what, const SectorIndex& home,
                                const SectorIndex& other) const {
  return finite(what, metres_between(home, other, settings_.sector_size), way_from_home_max(settings_), "m");
}

absl::Status RecordChecks::state(const BodyState& state) const {
  const Eigen::Vector3d position(state.position.data());
  absl::Status status = finite("position", position, way_from_home_max(settings_), "m");
  if (!status.ok()) return status;
  const Eigen::Matrix3d rotation(state.rotation.data());
  const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kRotationTolerance)) return refused("the rotation must be orthonormal, and is off by ", off);
  if (status = are_finite("linear velocity", state.linear_velocity); !status.ok()) return status;
  if (status = are_finite("angular velocity", state.angular_velocity); !status.ok()) return status;
  if (state.velocities_before) {
    const Velocities& before = *state.velocities_before;
    if (status = are_finite("linear velocity before", before.linear); !status.ok()) return status;
    if (status = are_finite("angular velocity before", before.angular); !status.ok()) return status;
  }
  return bounded("still_for", state.still_for, -kNoBound, kNoBound, "s");
}

absl::Status RecordChecks::record(const BodyRecord& record) const {
  if (absl::Status status = home(record.home); !status.ok()) return in(title_of(record.id), status);
  if (absl::Status status = properties(record.id, record.properties); !status.ok()) return status;
  if (absl::Status status = check_programs(record.properties, record.programs, settings_.modules);
      !status.ok())
    return in(title_of(record.id), status);
  return in(title_of(record.id), state(record.state));
}

absl::Status RecordChecks::joint(const JointRecord& record) const {
  if (record.id.value == 0) return refused("a joint's id must be at least 1");
  const auto is_finite = [](double number) { return std::isfinite(number); };
  const JointLoads& loads = record.loads;
  if (!std::ranges::all_of(loads.effort, is_finite) || !std::ranges::all_of(loads.force, is_finite) ||
      !std::ranges::all_of(loads.torque, is_finite))
    return refused("joint ", record.id.value, ": what it bore must be numbers");
  // Frames are given in centre frames, which these have, too.
  BodyProperties parent;
  BodyProperties child;
  parent.motion = record.parent_motion;
  const JointDescription description{absl::StrCat("joint ", record.id.value), record.properties,
                                     record.drives};
  return validate(description, record.properties.parent.value == 0 ? nullptr : &parent, child, settings_);
}

absl::Status RecordChecks::leaders(const AddJoint& command) const {
  if (absl::Status status = check_ties(command.leaders); !status.ok()) return status;
  for (const JointAxis& axis : axes_of(command.record.properties)) {
    const JointId id = axis.mimic.leader;
    if (!axis.mimic.is_set() ||
        std::ranges::any_of(command.leaders, [&](const JointTie& tie) { return tie.id == id; }))
      continue;
    return refused("joint ", command.record.id.value, ": it comes without the joint ", id.value,
                   ", which it follows");
  }
  return absl::OkStatus();
}

absl::Status RecordChecks::drives(const SetDrives& command) const {
  if (command.axes > kBothAxes)
    return refused("drives of joint ", command.id.value, ": axes = ", command.axes, " must be at most ",
                   kBothAxes);
  for (const JointDrive& drive : command.drives) {
    absl::Status status = first_error({bounded("target", drive.target, -kNoBound, kNoBound),
                                       bounded("stiffness", drive.stiffness, 0, kGainMax),
                                       bounded("damping", drive.damping, 0, kGainMax),
                                       bounded("velocity", drive.velocity, -kNoBound, kNoBound)});
    if (!status.ok()) return in(absl::StrCat("drives of joint ", command.id.value), status);
  }
  return absl::OkStatus();
}

absl::Status RecordChecks::radial(const ApplyRadialImpulse& command) const {
  const double size = settings_.sector_size;
  return in("radial impulse",
            first_error({finite("centre", Eigen::Vector3d(command.centre.data()), 4 * size, "m"),
                         bounded("radius", command.radius, 0, kRadialSectorsMax * size, "m"),
                         bounded("impulse", command.impulse, -kImpulseMax, kImpulseMax, "N s")}));
}

absl::Status RecordChecks::command(const Command& command) const {
  return std::visit(
      [&](const auto& c) -> absl::Status {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, SpawnBody>) {
          return record(c.record);
        } else if constexpr (std::is_same_v<C, AddJoint>) {
          return first_error({joint(c.record), leaders(c)});
        } else if constexpr (std::is_same_v<C, SetDrives>) {
          return drives(c);
        } else if constexpr (std::is_same_v<C, RemoveJoint>) {
          return absl::OkStatus();
        } else if constexpr (std::is_same_v<C, Teleport> || std::is_same_v<C, KinematicTarget>) {
          return first_error(
              {id(c.id), in(title_of(c.id), home(c.home)), in(title_of(c.id), state(c.state))});
        } else if constexpr (std::is_same_v<C, RemoveBody>) {
          return id(c.id);
        } else if constexpr (std::is_same_v<C, SetProperties>) {
          return properties(c.id, c.properties);
        } else if constexpr (std::is_same_v<C, ApplyRadialImpulse>) {
          return radial(c);
        } else {
          FiniteNumbers numbers;
          C::describe(numbers, c);
          return first_error(
              {id(c.id), numbers.all ? absl::OkStatus()
                                     : refused(title_of(c.id), ": a number of a command is not finite")});
        }
      },
      command);
}

absl::Status RecordChecks::acts(std::span<const Command> acts) const {
  for (const Command& act : acts) {
    if (!is_act(act)) return refused("a program does what no program can do");
    if (absl::Status status = command(act); !status.ok()) return in("what a program does", status);
  }
  return absl::OkStatus();
}

namespace {

// The records of a load, each checked by itself, and each body and joint once.
class Records {
 public:
  explicit Records(const RecordChecks& checks) : checks_(checks) {}

  absl::Status add(const BodyRecord& record) {
    if (absl::Status status = checks_.record(record); !status.ok()) return status;
    if (bodies_.insert(record.id).second) return absl::OkStatus();
    return refused(title_of(record.id), ": the id is given twice");
  }

  // After all static bodies.
  absl::Status add(const JointRecord& record) {
    if (absl::Status status = checks_.joint(record); !status.ok()) return status;
    if (!joints_.insert(record.id).second)
      return refused("joint ", record.id.value, ": the id is given twice");
    const BodyId parent = record.properties.parent;
    if (record.parent_motion != Motion::kStatic || parent.value == 0 || bodies_.contains(parent))
      return absl::OkStatus();
    return refused("joint ", record.id.value, ": its static parent ", parent.value, " is not there");
  }

 private:
  const RecordChecks& checks_;
  absl::flat_hash_set<BodyId> bodies_;
  absl::flat_hash_set<JointId> joints_;
};

// What comes along with a body that lives here.
absl::Status check_joints(const MovedBody& moved, Records& records) {
  if (absl::Status status = check_ties(moved.joints.as_parent); !status.ok()) return status;
  for (const JointTie& tie : moved.joints.as_parent) {
    if (tie.parent != moved.record.id) return refused("it is not the parent of joint ", tie.id.value);
  }
  for (const HeldJoint& held : moved.joints.as_child) {
    if (held.record.properties.child != moved.record.id)
      return refused("it is not the child of joint ", held.record.id.value);
    if (absl::Status status = records.add(held.record); !status.ok()) return status;
    if (absl::Status status = check_ties(held.coupled); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// Of the frames that have carriers; a state of before these has none.
absl::Status check_carried(std::span<const CarriedFrame> carried, std::span<const CarriedFrame> known) {
  if (carried.empty()) return absl::OkStatus();
  if (!std::ranges::equal(carried, known, {}, &CarriedFrame::frame, &CarriedFrame::frame))
    return refused("frames with carriers are not those of the settings");
  for (const CarriedFrame& frame : carried) {
    const std::string what = absl::StrCat("frame ", frame.frame);
    const FramePlace& place = frame.place;
    absl::Status status = finite("position", place.origin.local, kFrameReachMax, "m");
    if (status.ok()) status = unit_quaternion("orientation", place.orientation);
    if (status.ok()) status = finite("velocity", place.velocity);
    if (status.ok()) status = finite("spin", place.spin);
    if (status.ok()) status = finite("acceleration", frame.acceleration);
    if (status.ok()) status = finite("angular acceleration", frame.angular_acceleration);
    if (status.ok()) status = finite("owed momentum", frame.owed);
    if (status.ok()) status = finite("owed angular momentum", frame.owed_spin);
    if (status.ok()) status = bounded("mass aboard", frame.ballast.mass, 0, kAboardMax, "kg");
    if (status.ok()) status = bounded("inertia aboard", frame.ballast.inertia, 0, kAboardMax, "kg m^2");
    if (!status.ok()) return in(what, status);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status check(const Partition& partition, std::span<const BodyRecord> records,
                   std::span<const JointRecord> joints) {
  const RecordChecks checks = checks_of(partition);
  Records known(checks);
  for (const BodyRecord& record : records) {
    if (absl::Status status = known.add(record); !status.ok()) return status;
  }
  for (const JointRecord& record : joints) {
    if (absl::Status status = known.add(record); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status check(const Partition& partition, const SharedState& shared,
                   std::span<const MovedSector> sectors) {
  const RecordChecks checks = checks_of(partition);
  absl::Status status = bounded("the largest radius", shared.radius_max, 0, partition.sector_size(), "m");
  if (!status.ok()) return status;
  Records records(checks);
  for (const BodyRecord& record : shared.statics) {
    if (record.properties.motion != Motion::kStatic)
      return refused(title_of(record.id), ": it moves, and is listed as static");
    if (status = records.add(record); !status.ok()) return status;
  }
  if (status = checks.acts(shared.acts); !status.ok()) return status;
  if (status = check_carried(shared.carried, partition.carried); !status.ok()) return status;
  if (status = check_ties(shared.joints); !status.ok()) return status;
  for (const KnownReplica& known : shared.known_replicas) {
    status = checks.properties(known.introduction.id, known.introduction.properties);
    if (!status.ok()) return status;
    if (known.introduction.id != known.update.id) return refused("a replica has two ids");
    if (status = checks.home(known.update.home); !status.ok()) return status;
    if (status = checks.state(known.update.state); !status.ok()) return status;
  }
  absl::flat_hash_set<SectorIndex> known;
  for (const MovedSector& sector : sectors) {
    if (status = checks.home(sector.sector); !status.ok()) return status;
    if (!known.insert(sector.sector).second)
      return refused("sector ", to_string(sector.sector), " is given twice");
    for (const MovedBody& moved : sector.bodies) {
      if (moved.record.home != sector.sector || moved.record.properties.motion == Motion::kStatic)
        return refused(title_of(moved.record.id), ": it does not live in the sector that lists it");
      if (status = records.add(moved.record); !status.ok()) return status;
      if (moved.kinematic_target) status = checks.state(*moved.kinematic_target);
      if (status.ok()) status = check_joints(moved, records);
      if (!status.ok()) return in(title_of(moved.record.id), status);
    }
    absl::flat_hash_set<BodyId> clones;
    for (const MovedClone& clone : sector.clones) {
      status = checks.properties(clone.introduction.id, clone.introduction.properties);
      if (!status.ok()) return status;
      if (clone.introduction.id != clone.update.id || !clones.insert(clone.update.id).second)
        return refused(title_of(clone.update.id), ": a sector has two replicas of it");
      if (status = checks.home(clone.update.home); !status.ok()) return status;
      if (status = checks.state(clone.update.state); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

absl::Status check(const Partition& partition, std::span<const Command> commands) {
  const RecordChecks checks = checks_of(partition);
  absl::flat_hash_map<BodyId, BodyProperties> spawned;
  absl::flat_hash_set<JointId> added;
  for (const Command& command : commands) {
    if (absl::Status status = checks.command(command); !status.ok()) return status;
    if (const auto* spawn = std::get_if<SpawnBody>(&command)) {
      const BodyId id = spawn->record.id;
      if (properties_of(partition, id) || !spawned.try_emplace(id, spawn->record.properties).second)
        return refused(title_of(id), ": it is there already");
    } else if (const auto* change = std::get_if<SetProperties>(&command)) {
      const auto is_new = spawned.find(change->id);
      const std::optional<BodyProperties> now =
          is_new == spawned.end() ? properties_of(partition, change->id) : is_new->second;
      absl::Status status = now ? check_change(change->id, *now, change->properties) : absl::OkStatus();
      if (!status.ok()) return status;
    } else if (const auto* joint = std::get_if<AddJoint>(&command)) {
      const JointId id = joint->record.id;
      if (partition.joints.find(id) != nullptr || !added.insert(id).second)
        return refused("joint ", id.value, ": it is there already");
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera
