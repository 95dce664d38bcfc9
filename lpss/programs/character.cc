// Character: a dynamic body that walks upright.
//
// Its shape hovers: the program holds the centre of mass at a height above the ground that it feels with a
// ball and a ray, so that stairs pass under the shape. The shape itself, a capsule without friction, slides
// along what it walks into and pushes what can be pushed. What the program pushes off from gets the opposite
// impulse.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace character {
namespace {

enum class Parameter {
  kHeight,
  kStep,
  kSlope,
  kAcceleration,
  kAirAcceleration,
  kClimb,
  kTurn,
  kJumpHeight,
  kProbe,
  kCrouch
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"height", "m", 1, 0.01, 100, "Of the centre of mass above the ground, standing."},
    {"step", "m", 0.4, 0, 100,
     "The highest stair. The shape must end at least this far above the ground, and lower than `height`."},
    {"slope", "rad", 0.87, 0, 1.5, "The steepest ground that it stands on; from steeper ground it slides."},
    {"acceleration", "m/s^2", 20, 0, 1e4, "By which it changes its speed on the ground."},
    {"air_acceleration", "m/s^2", 2, 0, 1e4, "Likewise in the air."},
    {"climb", "m/s", 3, 0.01, 100, "How fast it rises and sinks to its height."},
    {"turn", "rad/s", 10, 0.01, 100, "How fast it turns to its heading, and rights itself."},
    {"jump_height", "m", 0.5, 0, 100, "How high it jumps, where gravity is the same all the way."},
    {"probe", "m", 0.1, 0.001, 10, "The radius of the ball that feels the ground."},
    {"crouch_depth", "m", 0.3, 0, 100,
     "How much lower it is when it crouches: no more than its shape ends above the ground."},
});

enum class Input { kX, kY, kHeading, kJump, kCrouch };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"x", "m/s", 0, -100, 100,
     "The velocity to walk with, beside what carries it, along the world's x axis,"},
    {"y", "m/s", 0, -100, 100, "and along its y axis."},
    {"heading", "rad", 0, -1e6, 1e6,
     "Where it faces: the angle from the world's x axis to its own, about z."},
    {"jump", "", 0, 0, 1, "It jumps once when this rises above 1/2."},
    {"crouch", "", 0, 0, 1, "How far it crouches: 0 is upright."},
});

enum class Value { kGrounded, kSlope, kGap, kGround, kJump };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"grounded", "", 0, 0, 0, "1 while it stands on something."},
    {"slope", "rad", 0, 0, 0, "Of the ground that it stands on."},
    {"gap", "m", 0, 0, 0, "By how much it is higher than it stands."},
    {"ground", kBodyUnit, 0, 0, 0, "What it stands on; 0: nothing."},
    {"jump", "", 0, 0, 0, "The input that it has answered."},
});

// What it may stand on.
struct Ground {
  const ProgramFinding* finding = nullptr;
  Eigen::Vector3d normal;
  double height = 0;  // m, of the centre of mass above it
};

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }
double input(const Senses& senses, Input place) { return at(senses.inputs, place); }

// m, of the centre of mass above the ground.
double height_of(const Senses& senses) {
  return parameter(senses, Parameter::kHeight) -
         input(senses, Input::kCrouch) * parameter(senses, Parameter::kCrouch);
}

Eigen::Vector3d up_of(const Senses& senses) {
  const double g = senses.gravity.norm();
  return g > 0 ? Eigen::Vector3d(-senses.gravity / g) : Eigen::Vector3d::UnitZ();
}

double tilt_of(double level) { return std::numbers::pi / 2 - portable::asin(std::min(level, 1.0)); }

Eigen::Vector3d shortened(const Eigen::Vector3d& v, double most) {
  const double length = v.norm();
  return length > most ? Eigen::Vector3d(v * (most / length)) : v;
}

std::optional<Ground> ground_in(const Senses& senses, const Eigen::Vector3d& up, std::uint32_t ask,
                                double radius) {
  for (const ProgramFinding& finding : senses.of(ask)) {
    const Eigen::Vector3d normal(finding.normal.data());
    const double level = normal.dot(up);
    if (level < portable::sincos(parameter(senses, Parameter::kSlope)).cos) return std::nullopt;
    // A ball on a slope touches it beside its lowest point.
    return Ground{&finding, normal, finding.distance + radius / level};
  }
  return std::nullopt;
}

class Character final : public Program {
 public:
  absl::string_view kind() const override { return "character"; }
  absl::string_view summary() const override {
    return "Walks upright on slopes and stairs, jumps, pushes, and rides on what moves.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    const Eigen::Vector3d down = -up_of(senses);
    const double reach = parameter(senses, Parameter::kHeight) + parameter(senses, Parameter::kStep);
    const double radius = parameter(senses, Parameter::kProbe);
    asker.cast(senses.position(), down, reach, radius);
    asker.cast(senses.position(), down, reach);
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const Eigen::Vector3d up = up_of(senses);
    std::optional<Ground> ground = ground_in(senses, up, 0, parameter(senses, Parameter::kProbe));
    if (!ground) ground = ground_in(senses, up, 1, 0);
    const Eigen::Vector3d carried =
        ground ? Eigen::Vector3d(ground->finding->velocity.data()) : Eigen::Vector3d::Zero();
    const Eigen::Vector3d relative = senses.velocity() - carried;
    if (ground && !holds(senses, values, *ground, relative.dot(up))) ground.reset();
    note(values, ground, up, height_of(senses));

    const Eigen::Vector3d wish = wish_of(senses, up);
    const bool jumps = wants_jump(senses, values) && ground;
    const Eigen::Vector3d change = ground ? on_ground(senses, *ground, up, wish, relative, jumps)
                                          : in_air(senses, up, wish, senses.velocity());
    if (jumps) at(values, Value::kGrounded) = 0;
    const bool stands = ground.has_value() && !jumps;
    act(senses, ground, stands, change, up, actor);
  }

 private:
  // What it has left, it reaches again when it falls on it.
  static bool holds(const Senses& senses, std::span<const double> values, const Ground& ground,
                    double rising) {
    const double gap = ground.height - height_of(senses);
    if (at(values, Value::kGrounded) > 0) return gap <= parameter(senses, Parameter::kStep);
    return rising <= 1e-3 && gap + rising * senses.dt <= 0;
  }

  static void note(std::span<double> values, const std::optional<Ground>& ground, const Eigen::Vector3d& up,
                   double height) {
    at(values, Value::kGrounded) = ground ? 1 : 0;
    at(values, Value::kSlope) = ground ? tilt_of(ground->normal.dot(up)) : 0;
    at(values, Value::kGap) = ground ? ground->height - height : 0;
    at(values, Value::kGround) = ground ? static_cast<double>(ground->finding->body.value) : 0;
  }

  static Eigen::Vector3d wish_of(const Senses& senses, const Eigen::Vector3d& up) {
    const Eigen::Vector3d wish(input(senses, Input::kX), input(senses, Input::kY), 0);
    return wish - up * wish.dot(up);
  }

  static bool wants_jump(const Senses& senses, std::span<double> values) {
    double& answered = at(values, Value::kJump);
    const double asked = input(senses, Input::kJump);
    const bool rises = asked > 0.5 && answered <= 0.5;
    answered = asked;
    return rises;
  }

  // The change of velocity in the next tick. It goes along the ground, and up or down to its height.
  static Eigen::Vector3d on_ground(const Senses& senses, const Ground& ground, const Eigen::Vector3d& up,
                                   const Eigen::Vector3d& wish, const Eigen::Vector3d& relative, bool jumps) {
    const Eigen::Vector3d level = relative - up * relative.dot(up);
    const Eigen::Vector3d faster =
        shortened(wish - level, parameter(senses, Parameter::kAcceleration) * senses.dt);
    const double slopes = ground.normal.dot(up);
    const Eigen::Vector3d next = level + faster;
    if (jumps) {
      const double rise = std::sqrt(2 * senses.gravity.norm() * parameter(senses, Parameter::kJumpHeight));
      return faster + up * (rise - relative.dot(up));
    }
    const double climb = parameter(senses, Parameter::kClimb);
    const double gap = ground.height - height_of(senses);
    // A quarter of the gap a tick: it settles without swinging.
    const double rising =
        -ground.normal.dot(next) / slopes + std::clamp(-gap / (4 * senses.dt), -climb, climb);
    return faster + up * (rising - relative.dot(up));
  }

  static Eigen::Vector3d in_air(const Senses& senses, const Eigen::Vector3d& up, const Eigen::Vector3d& wish,
                                const Eigen::Vector3d& velocity) {
    if (wish.isZero(0)) return Eigen::Vector3d::Zero();
    const Eigen::Vector3d level = velocity - up * velocity.dot(up);
    return shortened(wish - level, parameter(senses, Parameter::kAirAcceleration) * senses.dt);
  }

  // N m, that turns it to its heading, upright.
  static Eigen::Vector3d torque_to(const Senses& senses, const Eigen::Vector3d& up) {
    const Eigen::Quaterniond upright = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
    const double half = std::remainder(input(senses, Input::kHeading), 2 * std::numbers::pi) / 2;
    const auto [sin, cos] = portable::sincos(half);
    const Eigen::Quaterniond heading(cos, 0, 0, sin);
    const Eigen::Quaterniond off = upright * heading * senses.orientation().conjugate();
    const Eigen::Vector3d turn = rotation_vector(off.w() < 0 ? Eigen::Quaterniond(-off.coeffs()) : off);
    const Eigen::Vector3d rate = shortened(turn / senses.dt, parameter(senses, Parameter::kTurn));
    const Eigen::Matrix3d axes =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(senses.state.rotation.data());
    const Eigen::Matrix3d inertia = tensor_along(axes, Eigen::Vector3d(senses.properties.inertia.data()));
    return inertia * (rate - senses.angular_velocity()) / senses.dt;
  }

  static void act(const Senses& senses, const std::optional<Ground>& ground, bool stands,
                  const Eigen::Vector3d& change, const Eigen::Vector3d& up, Actor& actor) {
    const double mass = senses.properties.mass;
    const Eigen::Vector3d weight =
        senses.properties.gravity ? Eigen::Vector3d(mass * senses.gravity) : Eigen::Vector3d::Zero();
    Eigen::Vector3d force = mass * change / senses.dt;
    if (stands) force -= weight;
    const Eigen::Vector3d torque = torque_to(senses, up);
    // On what moves it stays awake: no contact would wake it when that leaves.
    const bool may_sleep = stands && ground->finding->motion == Motion::kStatic;
    const bool rests = change.norm() < kStill * senses.dt * senses.gravity.norm();
    if (may_sleep && rests) {
      actor.push(force, torque);
    } else {
      actor.push_awake(force, torque);
    }
    if (!may_sleep) actor.wake_in(1);
    if (ground && ground->finding->motion == Motion::kDynamic) {
      const Eigen::Vector3d lever =
          Eigen::Vector3d(ground->finding->point.data()) - Eigen::Vector3d(ground->finding->position.data());
      actor.impulse(ground->finding->body, -force * senses.dt, lever);
    }
  }

  static constexpr double kStill = 0.1;  // of the pull of gravity in a tick
};

}  // namespace
}  // namespace character

const Program& character_program() {
  static const character::Character kCharacter;
  return kCharacter;
}

}  // namespace tessera
