#include "lpss/programs/program.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"

namespace tessera {
namespace {

std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Acts are kept until the next tick, also in snapshots, which have finite numbers alone.
constexpr absl::string_view kNotFinite = "what it does is not finite";
bool are_finite(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.allFinite() && b.allFinite(); }

}  // namespace

Eigen::Quaterniond Senses::orientation() const {
  return quaternion_of(state) * centre_frame(properties).orientation.conjugate();
}

Eigen::Vector3d Senses::up() const {
  const double pull = gravity.norm();
  return pull > 0 ? Eigen::Vector3d(-gravity / pull) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014), over a counter.
double Senses::random(std::uint32_t n) const {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15;
  const auto mixed = [](std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
  };
  std::uint64_t number = 0;
  for (const std::uint64_t part : {body.value, std::uint64_t{program}, tick, std::uint64_t{n}})
    number = mixed(number + part + kGolden);
  constexpr double kUnit = 1.0 / (std::uint64_t{1} << 53);
  return static_cast<double>(number >> 11) * kUnit;
}

std::span<const ProgramFinding> Senses::of(std::uint32_t ask) const {
  const auto found = std::ranges::equal_range(findings, ask, {}, &ProgramFinding::ask);
  return {found.begin(), found.end()};
}

std::span<const SensedJoint> Senses::joints_of(std::uint32_t ask) const {
  const auto found = std::ranges::equal_range(joints, ask, {}, &SensedJoint::ask);
  return {found.begin(), found.end()};
}

ProgramAsk& Asker::add(ProgramAsk::Kind kind, BodyId body) {
  ProgramAsk& ask = asks_.emplace_back();
  ask.kind = kind;
  ask.body = body;
  ask.sector = senses_.sector;
  return ask;
}

void Asker::cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length, double radius,
                 std::uint32_t mask, std::optional<BodyId> through) {
  ProgramAsk& ask = add(ProgramAsk::kCast, through.value_or(senses_.body));
  ask.origin = array_of(from);
  ask.direction = array_of(direction);
  ask.length = length;
  ask.radius = radius;
  ask.mask = mask;
}

void Asker::contacts(BodyId body) { add(ProgramAsk::kContacts, body); }
void Asker::inside(BodyId body) { add(ProgramAsk::kInside, body); }
void Asker::body(BodyId body) { add(ProgramAsk::kBody, body); }
void Asker::visitors(BodyId body) { add(ProgramAsk::kVisitors, body).origin = senses_.state.position; }
void Asker::joints() { add(ProgramAsk::kJoints, senses_.body); }
void Asker::joint(JointId joint) { add(ProgramAsk::kJoint, senses_.body).joint = joint; }

bool is_act(const Command& command) {
  return std::holds_alternative<PushBody>(command) || std::holds_alternative<ApplyForce>(command) ||
         std::holds_alternative<ApplyImpulse>(command) || std::holds_alternative<KinematicTarget>(command) ||
         std::holds_alternative<Teleport>(command) || std::holds_alternative<RemoveJoint>(command) ||
         std::holds_alternative<SetDrives>(command) || std::holds_alternative<SetSurfaceMotion>(command) ||
         std::holds_alternative<TellProgram>(command);
}

void Actor::push(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
  if (!are_finite(force, torque)) return fail(kNotFinite);
  commands_.push_back(PushBody{senses_.body, {array_of(force), array_of(torque)}});
}

void Actor::push_awake(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
  if (!are_finite(force, torque)) return fail(kNotFinite);
  commands_.push_back(ApplyForce{senses_.body, {array_of(force), array_of(torque)}});
}

void Actor::impulse(BodyId body, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) {
  if (!are_finite(impulse, lever)) return fail(kNotFinite);
  commands_.push_back(ApplyImpulse{body, array_of(impulse), array_of(lever)});
}

void Actor::push_other(BodyId body, const Eigen::Vector3d& force) {
  if (!are_finite(force, force)) return fail(kNotFinite);
  commands_.push_back(ApplyForce{body, {array_of(force), {}}});
}

void Actor::move_to(const Eigen::Vector3d& position) {
  if (!are_finite(position, position)) return fail(kNotFinite);
  if (position.cwiseAbs().maxCoeff() > kProgramCastMax)
    return fail(absl::StrCat("it moves its body farther than ", kProgramCastMax, " m in a tick"));
  BodyState goal = senses_.state;
  goal.position = array_of(position);
  goal.velocities_before.reset();
  commands_.push_back(KinematicTarget{senses_.body, senses_.sector, goal});
}

void Actor::take_to(const ProgramFinding& body, const Eigen::Vector3d& position,
                    const Eigen::Vector3d& velocity, bool keeps_turning) {
  if (!are_finite(position, velocity)) return fail(kNotFinite);
  const absl::StatusOr<WorldPosition> place = canonical(senses_.sector, position, sector_size_);
  if (!place.ok()) return fail(place.status().message());
  Teleport jump{.id = body.body, .home = place->sector, .keeps_angular_velocity = keeps_turning};
  jump.state.position = array_of(place->local);
  jump.state.rotation = body.rotation;
  jump.state.linear_velocity = array_of(velocity);
  commands_.emplace_back(jump);
}

void Actor::drive(const SensedJoint& joint, std::size_t axis, const JointDrive& drive) {
  SetDrives* set = nullptr;  // by this run, of another axis
  for (Command& command : commands_) {
    if (auto* const of_joint = std::get_if<SetDrives>(&command); of_joint && of_joint->id == joint.record.id)
      set = of_joint;
  }
  SetDrives command = set ? *set : SetDrives{joint.record.id, joint.record.drives, 0};
  if (command.drives[axis] == drive) return;
  command.drives[axis] = drive;
  command.axes = static_cast<AxisMask>(command.axes | 1 << axis);
  if (const absl::Status status = validate(command.drives, joint.record.properties.type); !status.ok())
    return fail(absl::StrCat("joint ", joint.record.id.value, ": ", status.message()));
  if (set) {
    *set = command;
  } else {
    commands_.emplace_back(command);
  }
}

void Actor::move_surface(BodyId body, const Eigen::Vector3d& velocity, const Eigen::Vector3d& running) {
  if (!are_finite(velocity, running)) return fail(kNotFinite);
  if (std::max(velocity.norm(), running.norm()) > kSurfaceSpeedMax)
    return fail(absl::StrCat("it moves a surface faster than ", kSurfaceSpeedMax, " m/s"));
  commands_.push_back(SetSurfaceMotion{body, array_of(velocity), array_of(running)});
}

void Actor::remove_joint(JointId joint) { commands_.emplace_back(RemoveJoint{joint}); }

void Actor::tell(TellProgram told) { commands_.emplace_back(std::move(told)); }

absl::Status Program::check(const BodyProperties& properties) const {
  const std::optional<Motion> must = motion();
  if (!must || properties.motion == *must) return absl::OkStatus();
  return refused("its body must be ", name_of(*must), ", not ", name_of(properties.motion));
}

}  // namespace tessera
