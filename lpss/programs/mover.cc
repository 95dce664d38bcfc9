// Mover: takes a kinematic body to and fro along a straight way, as a lift, a sliding door or a ferry goes.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace mover {
namespace {

enum class Parameter { kX, kY, kZ, kSpeed, kAcceleration, kWait, kRepeat };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e4, 1e4, "The other end of the way, from where the body starts, along the world's axes."},
    {"y", "m", 0, -1e4, 1e4, "Likewise."},
    {"z", "m", 0, -1e4, 1e4, "Likewise."},
    {"speed", "m/s", 1, 1e-6, 1e3, "The greatest speed."},
    {"acceleration", "m/s^2", 1, 1e-6, 1e4, "Of starting and of braking."},
    {"wait", "s", 2, 0, 1e6, "At each end, where it repeats."},
    {"repeat", "", 0, 0, 1, "1: it goes to and fro for ever; 0: it goes where the input `goal` says."},
});

enum class Input { kGoal };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"goal", "", 0, 0, 1,
     "Where to go: 0 is the start of the way, 1 its other end. Not used where it repeats."},
});

enum class Value { kWay, kRate, kGoal, kWaited };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"way", "m", 0, 0, 0, "How far it is from its start."},
    {"rate", "m/s", 0, 0, 0, "Its speed; negative on the way back."},
    {"goal", "", 0, 0, 0, "The end that it goes to, or stands at."},
    {"waited", "s", 0, 0, 0, "How long it has stood at an end, where it repeats."},
});

// The rate of the next tick, on a way that is `left` (m) long: it speeds up, or brakes so that it stops at
// the end of the way. In a tick it goes rate * dt, so what it can still stop on is shorter by half of that.
double next_rate(double left, double rate, double speed, double acceleration, double dt) {
  const double change = acceleration * dt;
  const double brakes = -change / 2 + std::sqrt(change * change / 4 + 2 * acceleration * left);
  return std::min({rate + change, speed, brakes, left / dt});
}

class Mover final : public Program {
 public:
  absl::string_view kind() const override { return "mover"; }
  absl::string_view summary() const override {
    return "Takes a kinematic body to and fro along a straight way: a lift, a sliding door, a ferry.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kKinematic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const Eigen::Vector3d along(at(senses.parameters, Parameter::kX), at(senses.parameters, Parameter::kY),
                                at(senses.parameters, Parameter::kZ));
    const double length = along.norm();
    if (length == 0) return;
    choose_goal(senses, values, actor);
    double& way = at(values, Value::kWay);
    double& rate = at(values, Value::kRate);
    const double end = at(values, Value::kGoal) * length;
    if (way == end) {
      rate = 0;
      return;
    }
    const double side = end > way ? 1 : -1;
    const double left = std::abs(end - way);
    // What still goes the other way brakes first.
    const double towards = rate * side;
    const double acceleration = at(senses.parameters, Parameter::kAcceleration);
    const double next = towards < 0 ? std::min(towards + acceleration * senses.dt, 0.0)
                                    : next_rate(left, towards, at(senses.parameters, Parameter::kSpeed),
                                                acceleration, senses.dt);
    rate = side * next;
    const bool arrives = next * senses.dt >= left * (1 - 1e-9);
    way = arrives ? end : std::clamp(way + rate * senses.dt, 0.0, length);
    actor.move_to(senses.start + along * (way / length));
    actor.wake_in(1);
  }

 private:
  static void choose_goal(const Senses& senses, std::span<double> values, Actor& actor) {
    double& goal = at(values, Value::kGoal);
    if (at(senses.parameters, Parameter::kRepeat) < 0.5) {
      goal = at(senses.inputs, Input::kGoal);
      return;
    }
    goal = std::round(goal);
    const Eigen::Vector3d along(at(senses.parameters, Parameter::kX), at(senses.parameters, Parameter::kY),
                                at(senses.parameters, Parameter::kZ));
    if (at(values, Value::kWay) != goal * along.norm()) return;
    double& waited = at(values, Value::kWaited);
    actor.wake_in(1);
    waited += senses.dt;
    if (waited < at(senses.parameters, Parameter::kWait)) return;
    waited = 0;
    goal = 1 - goal;
  }
};

}  // namespace
}  // namespace mover

const Program& mover_program() {
  static const mover::Mover kMover;
  return kMover;
}

}  // namespace tessera
