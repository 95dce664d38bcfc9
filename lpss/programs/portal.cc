// Portal: takes what comes into the triggers of its body to another place, all of it or one body after the
// other. Spawners draw from a pool of bodies with it, and drains give them back.
#include <algorithm>
#include <array>
#include <cmath>

#include "lpss/base/divergence_kind.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace portal {
namespace {

using Eigen::Vector3d;

constexpr double kReach = 1e6;  // m
constexpr double kFastest = 0.999 * kSpeedMax;
constexpr double kLook = 0.1;  // s, after which it looks anew whether there is room

enum class Parameter { kX, kY, kZ, kArrange, kEvery, kRoom, kKeep, kVx, kVy, kVz, kSpread };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -kReach, kReach,
     "Its exit, from where the centre of mass of its body started, along the world's x axis,"},
    {"y", "m", 0, -kReach, kReach, "the y axis,"},
    {"z", "m", 0, -kReach, kReach, "and the z axis."},
    {"arrange", "", 1, 0, 1,
     "1: what comes lies about the exit as it lay about the portal; 0: all centres of mass go to the exit."},
    {"every", "s", 0, 0, 1e6, "It takes one body in this time, the nearest one first; 0: all at once."},
    {"room", "m", 0, 0, 100,
     "It takes one body, and only while a ball of this radius about the exit meets nothing; 0: it does not "
     "look."},
    {"keep", "", 1, 0, 1, "1: bodies keep their velocities, to which the following is added; 0: they stop."},
    {"vx", "m/s", 0, -1000, 1000, "The velocity that it gives, along the world's x axis,"},
    {"vy", "m/s", 0, -1000, 1000, "the y axis,"},
    {"vz", "m/s", 0, -1000, 1000, "and the z axis."},
    {"spread", "m/s", 0, 0, 1000, "By how much each of these is larger or smaller at random, at most."},
});

enum class Input { kOpen };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"open", "", 1, 0, 1, "It takes bodies while this is above 1/2."},
});

enum class Value { kTaken, kWaiting, kUntil };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"taken", "", 0, 0, 0, "How many it has taken."},
    {"waiting", "", 0, 0, 0, "How many in it wait to be taken."},
    {"until", "", 0, 0, 0, "A tick: before it, it takes no other."},
});

class Portal final : public Program {
 public:
  absl::string_view kind() const override { return "portal"; }
  absl::string_view summary() const override {
    return "Takes dynamic bodies in the triggers of its body to another place: a gate, a spawner, a drain.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }
  bool acts_on_others() const override { return true; }

  void ask(const Senses& senses, std::span<const double> values, Asker& asker) const override {
    if (!is_open(senses) || static_cast<double>(senses.tick) < at(values, Value::kUntil)) return;
    asker.visitors();
    if (room(senses) > 0) asker.cast(exit_of(senses), Vector3d::UnitZ(), 0, room(senses));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const double now = static_cast<double>(senses.tick);
    double& until = at(values, Value::kUntil);
    if (!is_open(senses)) return;
    if (now < until) return actor.wake_in(static_cast<std::uint64_t>(until - now));
    const double every = at(senses.parameters, Parameter::kEvery);
    const bool takes_one = every > 0 || room(senses) > 0;
    const bool has_room = senses.of(1).empty();
    double& waiting = at(values, Value::kWaiting) = 0;
    std::uint32_t taken = 0;
    for (const ProgramFinding& visitor : senses.of(0)) {
      // What joints hold together does not pass one by one.
      if (visitor.is_held) continue;
      if (!has_room || (takes_one && taken > 0) || taken == kTakenMax) {
        waiting += 1;
        continue;
      }
      take(senses, visitor, taken++, actor);
    }
    at(values, Value::kTaken) += taken;
    if (taken > 0 && every > 0) until = now + std::max(1.0, std::round(every / senses.dt));
    if (waiting == 0) return;
    const double look = has_room ? std::max(1.0, until - now) : std::max(1.0, std::round(kLook / senses.dt));
    actor.wake_in(static_cast<std::uint64_t>(look));
  }

 private:
  static constexpr std::uint32_t kTakenMax = 1000;  // at once; fewer than kProgramActsMax

  static bool is_open(const Senses& senses) { return at(senses.inputs, Input::kOpen) > 0.5; }
  static double room(const Senses& senses) { return at(senses.parameters, Parameter::kRoom); }
  static Vector3d vector(const Senses& senses, Parameter x, Parameter y, Parameter z) {
    return {at(senses.parameters, x), at(senses.parameters, y), at(senses.parameters, z)};
  }
  static Vector3d exit_of(const Senses& senses) {
    return senses.start + vector(senses, Parameter::kX, Parameter::kY, Parameter::kZ);
  }

  static void take(const Senses& senses, const ProgramFinding& visitor, std::uint32_t number, Actor& actor) {
    Vector3d place = exit_of(senses);
    if (at(senses.parameters, Parameter::kArrange) > 0.5)
      place += Vector3d(visitor.position.data()) - senses.position();
    const bool keeps = at(senses.parameters, Parameter::kKeep) > 0.5;
    Vector3d velocity = vector(senses, Parameter::kVx, Parameter::kVy, Parameter::kVz);
    if (keeps) velocity += Vector3d(visitor.velocity.data());
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      velocity[axis] +=
          at(senses.parameters, Parameter::kSpread) * (2 * senses.random(3 * number + axis) - 1);
    }
    if (const double speed = velocity.norm(); speed > kFastest) velocity *= kFastest / speed;
    actor.take_to(visitor, place, velocity, keeps);
  }
};

}  // namespace
}  // namespace portal

const Program& portal_program() {
  static const portal::Portal kPortal;
  return kPortal;
}

}  // namespace tessera
