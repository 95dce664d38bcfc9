// Treads: a vehicle whose tracks are bodies, with surfaces that run around them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace treads {
namespace {

constexpr double kBodyNumberMax = static_cast<double>(kBodyIdMax);
constexpr std::size_t kTrackCount = 6;  // left and right ones in turn

enum class Parameter { kTracks, kSeparation = 6, kEfficiency, kAcceleration, kTurnAcceleration, kCorrection };
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
    {"correction", "1/s", 0, 0, 100,
     "How fast its tracks make up for what the body falls short of, up to three times as fast as told; 0: "
     "they "
     "run as told."},
});

enum class Input { kSpeed, kTurn };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, -100, 100, "Forwards: to where the x axes of the tracks point."},
    {"turn", "rad/s", 0, -100, 100, "The rate of turn; above 0 to the left."},
});

enum class Value { kSpeed, kTurn, kLeft, kRight, kSlip, kTurnSlip };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "What it has come to of its input."},
    {"turn", "rad/s", 0, 0, 0, "Likewise."},
    {"left", "m/s", 0, 0, 0, "The speed of the left tracks,"},
    {"right", "m/s", 0, 0, 0, "and of the right ones."},
    {"slip", "m/s", 0, 0, 0, "What they run faster than told, to make up for what slips,"},
    {"turn_slip", "rad/s", 0, 0, 0, "and for what does not turn."},
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
    const double gain = parameter(Parameter::kCorrection) * senses.dt;
    const Eigen::Quaterniond axes = senses.orientation();
    correct(at(values, Value::kSlip), speed, senses.velocity().dot(axes * Eigen::Vector3d::UnitX()), gain);
    correct(at(values, Value::kTurnSlip), turn,
            senses.angular_velocity().dot(axes * Eigen::Vector3d::UnitZ()), gain);
    const double forwards = speed + at(values, Value::kSlip);
    const double apart = (turn + at(values, Value::kTurnSlip)) * parameter(Parameter::kSeparation) / 2 /
                         parameter(Parameter::kEfficiency);
    const std::array<double, 2> wanted = {bounded(forwards - apart), bounded(forwards + apart)};
    const std::array<double*, 2> runs = {&at(values, Value::kLeft), &at(values, Value::kRight)};
    for (std::size_t n = 0; n < kTrackCount; ++n) {
      const std::span<const ProgramFinding> found = senses.of(static_cast<std::uint32_t>(n));
      if (found.empty() || found.front().motion == Motion::kStatic) continue;
      if (*runs[n % 2] == wanted[n % 2]) continue;
      actor.move_surface(found.front().body, Eigen::Vector3d::Zero(), {0, wanted[n % 2], 0});
    }
    *runs[0] = wanted[0];
    *runs[1] = wanted[1];
    if (speed != 0 || turn != 0 || goal != 0 || turn_goal != 0) actor.wake_in(1);
  }

 private:
  static void correct(double& slip, double told, double is, double gain) {
    constexpr double kMost = 2;  // times what is told
    slip = std::clamp(slip + gain * (told - is), -kMost * std::abs(told), kMost * std::abs(told));
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
