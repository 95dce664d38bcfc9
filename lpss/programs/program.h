// Programs: what senses, decides and acts inside the tick.
//
// A program is a function of what its instance senses at the end of tick t and of its own numbers; what it
// does takes effect at the beginning of tick t + 1. All that it keeps is in its values: programs have no
// memory of their own, no clock and no source of chance, so that the same senses give the same acts on any
// server.
//
// An instance runs at the end of each tick in which its body is awake, and when it is new, is told something,
// or has asked to be woken. All lengths are in m, angles in rad, times in s; vectors are along the world's
// axes, and positions are relative to the centre of the sector in which the body lives.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/command.h"
#include "lpss/model/program.h"
#include "lpss/programs/senses.h"

namespace tessera {

// The units of numbers that are the id of a body or of a joint; 0: none.
inline constexpr absl::string_view kBodyUnit = "body";
inline constexpr absl::string_view kJointUnit = "joint";
// And of those that are the place of a program on a body, and of a value or an input of it: of the body, and
// the program, that come before it in the table, or else of the own body. World files may have their names.
inline constexpr absl::string_view kProgramUnit = "program";
inline constexpr absl::string_view kValueUnit = "value";
inline constexpr absl::string_view kInputUnit = "input";

// A number of a program. Those that come new are added at the end of their table: earlier worlds go on with
// what they have, and the new one's first value.
struct NumberSpec {
  absl::string_view name;
  absl::string_view unit;  // empty: a plain number
  double first = 0;        // where nothing else is said
  double least = 0;
  double most = 0;
  absl::string_view meaning;
};

// What an instance knows at the end of a tick. Valid within a call.
struct Senses {
  std::uint64_t tick = 0;  // that ends
  double dt = 0;           // s, of a tick
  BodyId body;
  std::uint32_t program = 0;  // its place on the body
  SectorIndex sector;
  const BodyProperties& properties;
  const BodyState& state;
  bool asleep = false;
  Eigen::Vector3d gravity;  // m/s^2, at the body
  Eigen::Vector3d start;    // where the centre of mass was when the instance was attached
  std::span<const double> parameters;
  std::span<const double> inputs;
  std::span<const ProgramFinding> findings;  // ascending by `ask`; of one, the nearest or lowest id first
  std::span<const SensedJoint> joints;       // ascending by `ask` and id
  // Those of the body, as they left this tick; of a kind that reads_others(), and while it runs. The values
  // of programs that read others are not for it.
  std::span<const ProgramRecord> programs = {};

  Eigen::Vector3d position() const { return Eigen::Vector3d(state.position.data()); }
  Eigen::Vector3d velocity() const { return Eigen::Vector3d(state.linear_velocity.data()); }
  Eigen::Vector3d angular_velocity() const { return Eigen::Vector3d(state.angular_velocity.data()); }
  // Of the body frame, to world axes.
  Eigen::Quaterniond orientation() const;
  // Against gravity, of unit length; the world's z axis where there is none.
  Eigen::Vector3d up() const;
  // At least 0 and less than 1: the n-th number by chance of this instance in this tick. It follows from the
  // body, the place of the program on it, and the tick.
  double random(std::uint32_t n) const;
  // What was found for the n-th question.
  std::span<const ProgramFinding> of(std::uint32_t ask) const;
  // The joints that were found for it.
  std::span<const SensedJoint> joints_of(std::uint32_t ask) const;
};

// Takes the questions of an instance, numbered from 0 in the order in which they come. Beyond
// kProgramAsksMax, the instance is stopped.
class Asker {
 public:
  Asker(const Senses& senses, std::vector<ProgramAsk>& asks, std::string& fault)
      : senses_(senses), asks_(asks), fault_(fault) {}

  // What a ball (a ray where `radius` is 0) meets first on its way of `length` (at most kProgramCastMax)
  // along `direction`, of unit length. It passes through triggers and the own body, or else through another
  // one.
  void cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length, double radius = 0,
            std::uint32_t mask = 0xffffffff, std::optional<BodyId> through = {});
  void contacts(BodyId body);
  // What is in the triggers of a body.
  void inside(BodyId body);
  void body(BodyId body);
  // The dynamic bodies in the triggers of a body, the nearest to the own one first, and how they move.
  void visitors(BodyId body);
  void visitors() { visitors(senses_.body); }
  // The joints of the own body: where they are, what drives them, and what they bear.
  void joints();
  // Likewise a joint of any bodies. Nothing is found where it is 0, or gone.
  void joint(JointId joint);
  // The instance is stopped.
  void fail(absl::string_view why) { fault_ = std::string(why); }

  std::size_t asked() const { return asks_.size(); }

 private:
  ProgramAsk& add(ProgramAsk::Kind kind, BodyId body);

  const Senses& senses_;
  std::vector<ProgramAsk>& asks_;
  std::string& fault_;
};

// Whether it is of the kind that an Actor gives.
bool is_act(const Command& command);

// Takes what an instance does. Beyond kProgramActsMax, the instance is stopped.
class Actor {
 public:
  // `sector_size` in m.
  Actor(const Senses& senses, double sector_size, std::vector<Command>& commands, std::uint64_t& wake_at,
        std::string& fault)
      : senses_(senses), sector_size_(sector_size), commands_(commands), wake_at_(wake_at), fault_(fault) {}

  // On the own body, for the next tick: N at the centre of mass, and N m. It lets a body at rest fall asleep,
  // and does nothing to one that sleeps.
  void push(const Eigen::Vector3d& force, const Eigen::Vector3d& torque);
  // The same, and it wakes the body.
  void push_awake(const Eigen::Vector3d& force, const Eigen::Vector3d& torque);
  // N s on another body that can move, at `lever` (m) from its centre of mass.
  void impulse(BodyId body, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever);
  // N at the centre of mass of another dynamic body, for the next tick. It wakes it.
  void push_other(BodyId body, const Eigen::Vector3d& force);
  // The own kinematic body arrives with its centre of mass at `position` at the end of the next tick, turned
  // as it is.
  void move_to(const Eigen::Vector3d& position);
  // A dynamic body that was met is at `position`, with its centre of mass, at the beginning of the next tick,
  // turned as it is, and moves on with `velocity` (m/s); it turns on only where it `keeps_turning`.
  void take_to(const ProgramFinding& body, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity,
               bool keeps_turning);
  // Sets the drive of an axis of a joint, and wakes its bodies; nothing where the axis has that drive. What
  // the axis cannot have stops the instance. Each axis is for one program.
  void drive(const SensedJoint& joint, std::size_t axis, const JointDrive& drive);
  // How the surface of a body that can move does so from then on (m/s, in its body frame): Surface::velocity
  // and Surface::running. What touches it wakes.
  void move_surface(BodyId body, const Eigen::Vector3d& velocity, const Eigen::Vector3d& running);
  // Takes a joint out of the world.
  void remove_joint(JointId joint);
  // Sets numbers of a program, of any body.
  void tell(TellProgram told);
  // It runs again in so many ticks (at least 1), even if its body sleeps.
  void wake_in(std::uint64_t ticks) { wake_at_ = senses_.tick + ticks; }
  // The instance is stopped, and does nothing.
  void fail(absl::string_view why) { fault_ = std::string(why); }

  std::size_t acts() const { return commands_.size(); }

 private:
  const Senses& senses_;
  const double sector_size_;
  std::vector<Command>& commands_;
  std::uint64_t& wake_at_;
  std::string& fault_;
};

// A kind of program. One object serves all instances, on all threads.
class Program {
 public:
  virtual ~Program() = default;

  virtual absl::string_view kind() const = 0;
  virtual absl::string_view summary() const = 0;  // a sentence
  virtual std::span<const NumberSpec> parameters() const = 0;
  virtual std::span<const NumberSpec> inputs() const = 0;
  virtual std::span<const NumberSpec> values() const = 0;

  // How many of its values an instance with these parameters has: the first ones. Also asked for parameters
  // that are out of their bounds, and refused afterwards.
  virtual std::size_t value_count(std::span<const double> /*parameters*/) const { return values().size(); }

  // How its body must move; nothing: dynamic or kinematic.
  virtual std::optional<Motion> motion() const { return std::nullopt; }
  // Whether it may remove joints of its body.
  virtual bool removes_joints() const { return false; }
  // Whether it reads the values of other programs of its body: it runs after them.
  virtual bool reads_others() const { return false; }
  // Whether it acts on bodies that it meets or finds, whoever's they are, by more than pushing off from them.
  virtual bool acts_on_others() const { return false; }
  // Whether it can work on such a body: INVALID_ARGUMENT, and what it must be.
  absl::Status check(const BodyProperties& properties) const;

  // What the instance needs to know. `values` are those that the last run left.
  virtual void ask(const Senses& /*senses*/, std::span<const double> /*values*/, Asker& /*asker*/) const {}
  // Decides, and changes its values.
  virtual void run(const Senses& senses, std::span<double> values, Actor& actor) const = 0;
};

}  // namespace tessera
