#include "lpss/programs/module_call.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <utility>
#include <vector>

#include "lpss/model/checks.h"
#include "lpss/model/limits.h"

namespace tessera {
namespace {

using wasm::Import;

constexpr double kIdMax = 9007199254740992;  // 2^53

bool is_id(double number) { return number >= 0 && number <= kIdMax && number == std::floor(number); }

// i32 numbers of a module that count from 0.
std::uint32_t count(double number) { return static_cast<std::uint32_t>(static_cast<std::int32_t>(number)); }

Eigen::Vector3d vector(const double* numbers) { return Eigen::Vector3d(numbers); }

absl::StatusOr<BodyId> body_id(double number) {
  if (is_id(number)) return BodyId{static_cast<std::uint64_t>(number)};
  return refused("body = ", number, " must be the id of a body");
}

template <typename... Parts>
std::vector<double> joined(const Parts&... parts) {
  std::vector<double> all;
  all.reserve(32);
  const auto append = [&all](const auto& part) {
    if constexpr (requires { part.data(); }) {
      all.insert(all.end(), part.data(), part.data() + part.size());
    } else {
      all.push_back(static_cast<double>(part));
    }
  };
  (append(parts), ...);
  return all;
}

}  // namespace

bool ModuleCall::end(std::string why) {
  is_over = true;
  fault = std::move(why);
  return false;
}

bool ModuleCall::take(const absl::Status& status) {
  return status.ok() || end(std::string(status.message()));
}

bool ModuleCall::call(Import import, const double* arguments, double& result) {
  if (import < Import::kCast) return read(import, arguments, result);
  if (import < Import::kPush) return ask(import, arguments);
  return act(import, arguments);
}

bool ModuleCall::read(Import import, const double* arguments, double& result) {
  switch (import) {
    case Import::kParameters:
      return write(arguments[0], senses_.parameters);
    case Import::kInputs:
      return write(arguments[0], senses_.inputs);
    case Import::kValues:
      return write(arguments[0], values_);
    case Import::kSetValues:
      return set_values(arguments[0]);
    case Import::kSenses:
      return write_senses(arguments[0]);
    case Import::kRandom:
      result = senses_.random(count(arguments[0]));
      return true;
    case Import::kFindings:
      result = static_cast<double>(senses_.of(count(arguments[0])).size());
      return true;
    case Import::kFinding:
      return write_finding(arguments[0], arguments[1], arguments[2]);
    case Import::kJointFindings:
      result = static_cast<double>(senses_.joints_of(count(arguments[0])).size());
      return true;
    default:
      return write_joint_finding(arguments[0], arguments[1], arguments[2]);
  }
}

std::span<std::uint8_t> ModuleCall::place(double address, std::size_t numbers) {
  const auto begin = static_cast<std::uint32_t>(static_cast<std::int32_t>(address));
  const std::size_t bytes = numbers * sizeof(double);
  if (bytes <= memory.size() && begin <= memory.size() - bytes) return memory.subspan(begin, bytes);
  end("it hands out a place outside its memory");
  return {};
}

bool ModuleCall::write(double address, std::span<const double> numbers) {
  const std::span<std::uint8_t> to = place(address, numbers.size());
  if (is_over || to.empty()) return !is_over;
  std::memcpy(to.data(), numbers.data(), to.size());
  const auto first = static_cast<std::size_t>(to.data() - memory.data()) >> block_shift;
  const auto last = static_cast<std::size_t>(to.data() + to.size() - 1 - memory.data()) >> block_shift;
  for (std::size_t block = first; block <= last; ++block) dirty |= std::uint32_t{1} << block;
  return true;
}

bool ModuleCall::set_values(double address) {
  if (actor == nullptr) return end("values can be set in run() alone");
  const std::span<std::uint8_t> from = place(address, values_.size());
  if (!is_over && !from.empty()) std::memcpy(values_.data(), from.data(), from.size());
  return !is_over;
}

bool ModuleCall::write_senses(double address) {
  return write(address,
               joined(senses_.tick, senses_.dt, senses_.body.value, senses_.program, senses_.asleep ? 1 : 0,
                      senses_.properties.mass, senses_.position(), senses_.orientation().coeffs(),
                      senses_.velocity(), senses_.angular_velocity(), senses_.gravity, senses_.start));
}

bool ModuleCall::write_finding(double ask, double place, double address) {
  const auto all = senses_.of(count(ask));
  if (place < 0 || place >= static_cast<double>(all.size()))
    return end(absl::StrCat("it looks at finding ", place, " of ", all.size()));
  const ProgramFinding& found = all[static_cast<std::size_t>(place)];
  return write(address, joined(found.body.value, static_cast<int>(found.motion), found.distance, found.normal,
                               found.point, found.velocity, found.impulse, found.position, found.rotation));
}

// Of axes that the joint does not have, 0.
bool ModuleCall::write_joint_finding(double ask, double place, double address) {
  const auto all = senses_.joints_of(count(ask));
  if (place < 0 || place >= static_cast<double>(all.size()))
    return end(absl::StrCat("it looks at joint ", place, " of ", all.size()));
  const auto& [_, record, state] = all[static_cast<std::size_t>(place)];
  const JointProperties& properties = record.properties;
  const std::span<const JointAxis> axes = axes_of(properties);
  const auto by_axis = [&](const auto& number_of) {
    std::array<double, 2> numbers{};
    for (std::size_t n = 0; n < axes.size(); ++n) numbers[n] = number_of(n);
    return numbers;
  };
  return write(address,
               joined(record.id.value, static_cast<int>(properties.type), properties.parent.value,
                      properties.child.value, axes.size(), state.position, state.velocity,
                      by_axis([&](std::size_t n) { return axes[n].lower; }),
                      by_axis([&](std::size_t n) { return axes[n].upper; }), record.loads.effort,
                      by_axis([&](std::size_t n) { return static_cast<double>(record.drives[n].mode); }),
                      by_axis([&](std::size_t n) { return record.drives[n].target; }), record.loads.force,
                      record.loads.torque, state.gap));
}

bool ModuleCall::ask(Import import, const double* arguments) {
  if (asker == nullptr) return end("questions can be asked in ask() alone");
  if (asker->asked() > kProgramAsksMax) return end("");
  if (import == Import::kCast) {
    asker->cast(vector(arguments), vector(arguments + 3), arguments[6], arguments[7], count(arguments[8]));
    return true;
  }
  if (import == Import::kJoints) {
    asker->joints();
    return true;
  }
  if (import == Import::kJoint) {
    if (!is_id(arguments[0]))
      return end(absl::StrCat("joint = ", arguments[0], " must be the id of a joint"));
    asker->joint({static_cast<std::uint64_t>(arguments[0])});
    return true;
  }
  const absl::StatusOr<BodyId> id = body_id(arguments[0]);
  if (!id.ok()) return take(id.status());
  if (import == Import::kContacts) asker->contacts(*id);
  if (import == Import::kInside) asker->inside(*id);
  if (import == Import::kBody) asker->body(*id);
  return true;
}

bool ModuleCall::act(Import import, const double* arguments) {
  if (actor == nullptr) return end("acts belong into run()");
  if (actor->acts() > kProgramActsMax) return end("");
  switch (import) {
    case Import::kPush:
    case Import::kPushAwake:
      return take(push(import, arguments));
    case Import::kImpulse:
      return take(impulse(arguments));
    case Import::kMoveTo:
      return take(move_to(arguments));
    case Import::kTell:
      return take(tell(arguments));
    case Import::kDrive:
      return take(drive(arguments));
    case Import::kRemoveJoint:
      return take(remove_joint(arguments[0]));
    default:
      if (arguments[0] < 1) return end(absl::StrCat("wake_in: ", arguments[0], " ticks must be at least 1"));
      actor->wake_in(static_cast<std::uint64_t>(arguments[0]));
      return true;
  }
}

absl::Status ModuleCall::push(Import import, const double* arguments) {
  const Motion motion = senses_.properties.motion;
  if (motion != Motion::kDynamic) return refused("push: its body must be dynamic, not ", name_of(motion));
  const Eigen::Vector3d force = vector(arguments);
  const Eigen::Vector3d torque = vector(arguments + 3);
  if (absl::Status status = finite("push: force", force, kForceMax, "N"); !status.ok()) return status;
  if (absl::Status status = finite("push: torque", torque, kTorqueMax, "N m"); !status.ok()) return status;
  if (import == Import::kPush) {
    actor->push(force, torque);
  } else {
    actor->push_awake(force, torque);
  }
  return absl::OkStatus();
}

absl::Status ModuleCall::impulse(const double* arguments) {
  const absl::StatusOr<BodyId> id = body_id(arguments[0]);
  if (!id.ok()) return in("impulse", id.status());
  const Eigen::Vector3d impulse = vector(arguments + 1);
  const Eigen::Vector3d lever = vector(arguments + 4);
  if (absl::Status status = finite("impulse", impulse, kImpulseMax, "N s"); !status.ok()) return status;
  if (absl::Status status = finite("impulse: lever", lever, kLeverMax, "m"); !status.ok()) return status;
  actor->impulse(*id, impulse, lever);
  return absl::OkStatus();
}

absl::Status ModuleCall::move_to(const double* arguments) {
  const Motion motion = senses_.properties.motion;
  if (motion != Motion::kKinematic)
    return refused("move_to: its body must be kinematic, not ", name_of(motion));
  const Eigen::Vector3d position = vector(arguments);
  if (absl::Status status = finite("move_to: position", position, kProgramCastMax, "m"); !status.ok())
    return status;
  actor->move_to(position);
  return absl::OkStatus();
}

absl::Status ModuleCall::tell(const double* arguments) {
  const absl::StatusOr<BodyId> id = body_id(arguments[0]);
  if (!id.ok()) return in("tell", id.status());
  if (!(arguments[1] >= 0 && arguments[1] < kProgramsPerBodyMax))
    return refused("tell: program = ", arguments[1], " must be below ", kProgramsPerBodyMax);
  if (!(arguments[2] >= 0 && arguments[2] < kProgramNumbersMax))
    return refused("tell: input = ", arguments[2], " must be below ", kProgramNumbersMax);
  if (!std::isfinite(arguments[3])) return refused("tell: value = ", arguments[3], " must be finite");
  actor->tell({*id,
               static_cast<std::uint32_t>(arguments[1]),
               {{static_cast<std::uint32_t>(arguments[2]), arguments[3]}},
               {}});
  return absl::OkStatus();
}

const SensedJoint* ModuleCall::found(double joint) const {
  const auto found = std::ranges::find_if(senses_.joints, [&](const SensedJoint& sensed) {
    return static_cast<double>(sensed.record.id.value) == joint;
  });
  return found == senses_.joints.end() ? nullptr : &*found;
}

absl::Status ModuleCall::remove_joint(double id) {
  const SensedJoint* const joint = found(id);
  if (joint == nullptr)
    return refused("remove_joint: joint = ", id, " must be one that was asked for and is there");
  const JointProperties& properties = joint->record.properties;
  if (properties.parent != senses_.body && properties.child != senses_.body)
    return refused("remove_joint: joint = ", id, " must be one of its body");
  actor->remove_joint(joint->record.id);
  return absl::OkStatus();
}

absl::Status ModuleCall::drive(const double* arguments) {
  const SensedJoint* const joint = found(arguments[0]);
  if (joint == nullptr)
    return refused("drive: joint = ", arguments[0], " must be one that was asked for and is there");
  const auto axes = axes_of(joint->record.properties).size();
  if (!(arguments[1] >= 0 && arguments[1] < static_cast<double>(axes)))
    return refused("drive: axis = ", arguments[1], " must be below ", axes, ", the axes of joint ",
                   arguments[0]);
  if (!(arguments[2] >= 0 && arguments[2] <= static_cast<double>(DriveMode::kServo)))
    return refused("drive: mode = ", arguments[2], " must be at most ", static_cast<int>(DriveMode::kServo));
  actor->drive(*joint, static_cast<std::size_t>(arguments[1]),
               {.mode = static_cast<DriveMode>(arguments[2]),
                .target = arguments[3],
                .stiffness = arguments[4],
                .damping = arguments[5],
                .velocity = arguments[6],
                .effort = arguments[7]});
  return absl::OkStatus();
}

}  // namespace tessera
