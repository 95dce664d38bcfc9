// Belt: the surface of its body moves, and carries what is on it.
#include <array>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace belt {
namespace {

enum class Parameter { kTurn, kRound, kAcceleration };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"turn", "rad", 0, -7, 7, "Where it carries to: turned from the body's x axis towards its y axis."},
    {"round", "", 0, 0, 1,
     "0: all of the surface moves alike; 1: it runs round the body as a track does, back where it points "
     "downwards."},
    {"acceleration", "m/s^2", 1, 1e-6, 1e4, "By which it changes its speed."},
});

enum class Input { kSpeed };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, -kSurfaceSpeedMax, kSurfaceSpeedMax, "Of the surface."},
});

enum class Value { kSpeed };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "What it has come to of its input."},
});

class Belt final : public Program {
 public:
  absl::string_view kind() const override { return "belt"; }
  absl::string_view summary() const override {
    return "Moves the surface of its body, which carries what is on it: a conveyor, a moving walkway.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const double goal = at(senses.inputs, Input::kSpeed);
    double& speed = at(values, Value::kSpeed);
    if (speed == goal) return;
    speed = nearer(speed, goal, at(senses.parameters, Parameter::kAcceleration) * senses.dt);
    const auto [sin, cos] = portable::sincos(at(senses.parameters, Parameter::kTurn));
    if (at(senses.parameters, Parameter::kRound) < 0.5) {
      actor.move_surface(senses.body, {speed * cos, speed * sin, 0}, Eigen::Vector3d::Zero());
    } else {
      actor.move_surface(senses.body, Eigen::Vector3d::Zero(), {-speed * sin, speed * cos, 0});
    }
    if (speed != goal) actor.wake_in(1);
  }
};

}  // namespace
}  // namespace belt

const Program& belt_program() {
  static const belt::Belt kBelt;
  return kBelt;
}

}  // namespace tessera
