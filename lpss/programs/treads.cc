// Treads: a vehicle whose tracks are bodies, with surfaces that run around them.
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "lpss/model/limits.h"
#include "lpss/programs/body_inertia.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace treads {
namespace {

constexpr double kBodyNumberMax = static_cast<double>(kBodyIdMax);
constexpr std::size_t kTrackCount = 6;  // left and right ones in turn

enum class Parameter {
  kTracks,
  kSeparation = 6,
  kEfficiency,
  kAcceleration,
  kTurnAcceleration,
  kHelp,
  kTurnHelp
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"left", kBodyUnit, 0, 0, kBodyNumberMax, "The left track, around whose y axis its surface runs,"},
    {"right", kBodyUnit, 0, 0, kBodyNumberMax, "and the right one, likewise."},
    {"left_2", kBodyUnit, 0, 0, kBodyNumberMax,
     "Another one on the left, as of a flipper; 0: there is none,"},
    {"right_2", kBodyUnit, 0, 0, kBodyNumberMax, "and on the right,"},
    {"left_3", kBodyUnit, 0, 0, kBodyNumberMax, "a third one on the left"},
    {"right_3", kBodyUnit, 0, 0, kBodyNumberMax, "and on the right."},
    {"separation", "m", 1, 0.001, 100, "From the left track to the right one."},
    {"efficiency", "", 0.5, 0.01, 1,
     "Of turning: what of the difference of the tracks turns it, and does not slip."},
    {"acceleration", "m/s^2", 1, 1e-6, 1e4, "By which it changes its speed."},
    {"turn_acceleration", "rad/s^2", 2, 1e-6, 1e4, "By which it changes its rate of turn."},
    {"help", "N", 0, 0, kForceMax,
     "The greatest force along its x axis by which the body is led to its speed, beside its tracks;"},
    {"turn_help", "N m", 0, 0, kTorqueMax,
     "and the greatest torque about its z axis: long tracks hold it where it is."},
});

enum class Input { kSpeed, kTurn };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, -100, 100, "Forwards: to where the x axes of the tracks point."},
    {"turn", "rad/s", 0, -100, 100, "The rate of turn; above 0 to the left."},
});

enum class Value { kSpeed, kTurn, kLeft, kRight, kHelp, kTurnHelp };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "What it has come to of its input."},
    {"turn", "rad/s", 0, 0, 0, "Likewise."},
    {"left", "m/s", 0, 0, 0, "The speed of the left tracks,"},
    {"right", "m/s", 0, 0, 0, "and of the right ones."},
    {"help", "N", 0, 0, 0, "The force that leads it without an error,"},
    {"turn_help", "N m", 0, 0, 0, "and the torque."},
});

class Treads final : public Program {
 public:
  absl::string_view kind() const override { return "treads"; }
  absl::string_view summary() const override {
    return "Drives a vehicle by the surfaces of its tracks, which are bodies of their own.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    for (std::size_t n = 0; n < kTrackCount; ++n)
      asker.body(BodyId{static_cast<std::uint64_t>(senses.parameters[n])});
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const auto parameter = [&](Parameter place) { return at(senses.parameters, place); };
    double& speed = at(values, Value::kSpeed);
    double& turn = at(values, Value::kTurn);
    const double goal = at(senses.inputs, Input::kSpeed);
    const double turn_goal = at(senses.inputs, Input::kTurn);
    speed = nearer(speed, goal, parameter(Parameter::kAcceleration) * senses.dt);
    turn = nearer(turn, turn_goal, parameter(Parameter::kTurnAcceleration) * senses.dt);
    const double apart = turn * parameter(Parameter::kSeparation) / 2 / parameter(Parameter::kEfficiency);
    const std::array<double, 2> wanted = {bounded(speed - apart), bounded(speed + apart)};
    const std::array<double*, 2> runs = {&at(values, Value::kLeft), &at(values, Value::kRight)};
    for (std::size_t n = 0; n < kTrackCount; ++n) {
      const std::span<const ProgramFinding> found = senses.of(static_cast<std::uint32_t>(n));
      if (found.empty() || found.front().motion == Motion::kStatic) continue;
      if (*runs[n % 2] == wanted[n % 2]) continue;
      actor.move_surface(found.front().body, Eigen::Vector3d::Zero(), {0, wanted[n % 2], 0});
    }
    *runs[0] = wanted[0];
    *runs[1] = wanted[1];
    const bool is_driven = speed != 0 || turn != 0 || goal != 0 || turn_goal != 0;
    if (is_driven) actor.wake_in(1);
    help(senses, values, is_driven, actor);
  }

 private:
  // Of what an error asks for, that is kept: so that it is led on without an error.
  static constexpr double kKept = 0.2;

  static void help(const Senses& senses, std::span<double> values, bool is_driven, Actor& actor) {
    double& force = at(values, Value::kHelp);
    double& torque = at(values, Value::kTurnHelp);
    const double most = at(senses.parameters, Parameter::kHelp);
    const double most_turn = at(senses.parameters, Parameter::kTurnHelp);
    if (!is_driven || (most == 0 && most_turn == 0)) {
      force = torque = 0;
      return;
    }
    const Eigen::Quaterniond axes = senses.orientation();
    const Eigen::Vector3d along = axes * Eigen::Vector3d::UnitX();
    const Eigen::Vector3d about = axes * Eigen::Vector3d::UnitZ();
    const double inertia = body_inertia(senses.properties)(2, 2);
    const double slow =
        senses.properties.mass / senses.dt * (at(values, Value::kSpeed) - senses.velocity().dot(along));
    const double late =
        inertia / senses.dt * (at(values, Value::kTurn) - senses.angular_velocity().dot(about));
    force = std::clamp(force + kKept * slow, -most, most);
    torque = std::clamp(torque + kKept * late, -most_turn, most_turn);
    actor.push_awake(std::clamp(force + slow, -most, most) * along,
                     std::clamp(torque + late, -most_turn, most_turn) * about);
  }

  static double bounded(double speed) { return std::clamp(speed, -kSurfaceSpeedMax, kSurfaceSpeedMax); }
};

}  // namespace
}  // namespace treads

const Program& treads_program() {
  static const treads::Treads kTreads;
  return kTreads;
}

}  // namespace tessera
