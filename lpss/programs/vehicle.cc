// Vehicle: a dynamic body on four wheels that are rays, with springs, tyres, an engine and brakes.
//
// The forces at the wheels are found together, as contacts are: in a few passes over all wheels, each tyre
// holds its point of the ground as far as its grip allows (Catto, "Iterative Dynamics with Temporal
// Coherence", 2005). So a car that is parked on a slope stands, and one that slides is slowed down by no more
// than friction can.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace vehicle {
namespace {

enum class Parameter {
  kWheelbase,
  kTrack,
  kMount,
  kRadius,
  kTravel,
  kStiffness,
  kDamping,
  kGrip,
  kEngine,
  kBrake,
  kSpeed,
  kSteer,
  kSteerRate,
  kFrontDrive,
  kRearDrive,
  kRolling
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"wheelbase", "m", 2.6, 0.01, 100, "From the rear axle to the front axle, along the body's x axis."},
    {"track", "m", 1.5, 0.01, 100, "From the left wheels to the right ones, along its y axis."},
    {"mount", "m", 0, -100, 100, "How high the upper ends of the springs are above the centre of mass."},
    {"radius", "m", 0.3, 0.001, 10, "Of a wheel."},
    {"travel", "m", 0.4, 0.001, 10,
     "Of a spring, from its upper end to where the hub is while the wheel hangs."},
    {"stiffness", "N/m", 3e4, 0, kGainMax, "Of a spring."},
    {"damping", "N s/m", 3e3, 0, kGainMax, "Of a damper."},
    {"grip", "", 1, 0, 10, "Of a tyre: the coefficient of friction, in all directions."},
    {"engine_force", "N", 6e3, 0, kForceMax,
     "The greatest force of the engine on all driven wheels together."},
    {"brake_force", "N", 1e4, 0, kForceMax, "Of the brakes on each wheel."},
    {"speed", "m/s", 50, 0.01, 1e3, "From which on the engine does not push any more."},
    {"steer_angle", "rad", 0.6, 0, 1.5,
     "How far the front wheels turn, as seen in the middle of their axle."},
    {"steer_rate", "rad/s", 1.5, 0.001, 100, "How fast they turn."},
    {"front_drive", "", 0, 0, 1, "1: the front wheels are driven,"},
    {"rear_drive", "", 1, 0, 1, "and the rear ones."},
    {"rolling", "", 0.012, 0, 1, "Rolling resistance, as a part of what a wheel bears."},
});

enum class Input { kThrottle, kBrake, kSteer };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"throttle", "", 0, -1, 1, "Of the engine's force; below 0 it pushes back."},
    {"brake", "", 0, 0, 1, "Of the brakes' force."},
    {"steer", "", 0, -1, 1, "Of the largest angle; above 0 to the left."},
});

enum class Value { kSpeed, kSteer, kOnGround, kSpring };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "Forwards, over what it stands on."},
    {"angle", "rad", 0, 0, 0, "Of the front wheels, in the middle of their axle; to the left."},
    {"wheels_on_ground", "", 0, 0, 0, "How many."},
    {"spring_0", "m", 0, 0, 0, "How far the spring of the left front wheel is compressed,"},
    {"spring_1", "m", 0, 0, 0, "of the right front wheel,"},
    {"spring_2", "m", 0, 0, 0, "of the left rear wheel,"},
    {"spring_3", "m", 0, 0, 0, "and of the right rear wheel."},
});

constexpr std::size_t kWheels = 4;
constexpr int kPasses = 16;

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }
double input(const Senses& senses, Input place) { return at(senses.inputs, place); }

// A body that impulses act on: its velocities as they are going to be at the end of the next tick.
struct Chassis {
  explicit Chassis(const Senses& senses)
      : mass(senses.properties.mass), linear(senses.velocity()), angular(senses.angular_velocity()) {
    const Eigen::Matrix3d axes =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(senses.state.rotation.data());
    const Eigen::Vector3d inertia(senses.properties.inertia.data());
    mobility = tensor_along(axes, Eigen::Vector3d(inertia.cwiseInverse()));
    if (senses.properties.gravity) linear += senses.gravity * senses.dt;
  }

  Eigen::Vector3d velocity_at(const Eigen::Vector3d& lever) const { return linear + angular.cross(lever); }
  // N s that change the velocity at a place along a way by 1 m/s.
  double resistance(const Eigen::Vector3d& lever, const Eigen::Vector3d& way) const {
    const Eigen::Vector3d turn = lever.cross(way);
    return 1 / (1 / mass + turn.dot(mobility * turn));
  }
  void push(const Eigen::Vector3d& lever, const Eigen::Vector3d& by) {
    linear += by / mass;
    angular += mobility * lever.cross(by);
    impulse += by;
    spin += lever.cross(by);
  }

  double mass;
  Eigen::Matrix3d mobility;
  Eigen::Vector3d linear;
  Eigen::Vector3d angular;
  Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // N s, of all pushes
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();     // N m s
};

struct Wheel {
  const ProgramFinding* ground = nullptr;  // null: it hangs
  Eigen::Vector3d lever;                   // of its point on the ground, from the centre of mass
  Eigen::Vector3d carried;                 // m/s, of that ground
  Eigen::Vector3d normal;
  Eigen::Vector3d forward;
  Eigen::Vector3d left;
  double load = 0;                                  // N s, in the next tick
  double engine = 0;                                // N s
  double brake = 0;                                 // N s, at most
  Eigen::Vector2d tyre = Eigen::Vector2d::Zero();   // N s, forward and to the left
  Eigen::Vector3d given = Eigen::Vector3d::Zero();  // N s, to the body
};

class Vehicle final : public Program {
 public:
  absl::string_view kind() const override { return "vehicle"; }
  absl::string_view summary() const override {
    return "Four wheels with springs and tyres for a body whose x axis points forwards and whose z axis "
           "points up.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    const Eigen::Quaterniond turn = senses.orientation();
    const double reach = parameter(senses, Parameter::kTravel) + parameter(senses, Parameter::kRadius);
    for (std::size_t n = 0; n < kWheels; ++n)
      asker.cast(senses.position() + turn * mount_of(senses, n), turn * -Eigen::Vector3d::UnitZ(), reach);
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    steer(senses, values);
    Chassis chassis(senses);
    std::array<Wheel, kWheels> wheels;
    for (std::size_t n = 0; n < kWheels; ++n) wheels[n] = wheel_at(senses, values, chassis, n);
    note(senses, wheels, values);
    for (Wheel& wheel : wheels) {
      if (wheel.ground == nullptr) continue;
      push(chassis, wheel, wheel.normal * wheel.load + wheel.forward * wheel.engine);
    }
    for (int pass = 0; pass < kPasses; ++pass) {
      for (Wheel& wheel : wheels) {
        if (wheel.ground != nullptr) hold(chassis, wheel, parameter(senses, Parameter::kGrip));
      }
    }
    act(senses, chassis, wheels, actor);
  }

 private:
  // In the body frame, from the centre of mass: left and right in front, then behind.
  static Eigen::Vector3d mount_of(const Senses& senses, std::size_t n) {
    return {(n < 2 ? 0.5 : -0.5) * parameter(senses, Parameter::kWheelbase),
            (n % 2 == 0 ? 0.5 : -0.5) * parameter(senses, Parameter::kTrack),
            parameter(senses, Parameter::kMount)};
  }

  static void steer(const Senses& senses, std::span<double> values) {
    double& angle = at(values, Value::kSteer);
    const double wanted = input(senses, Input::kSteer) * parameter(senses, Parameter::kSteer);
    const double most = parameter(senses, Parameter::kSteerRate) * senses.dt;
    angle += std::clamp(wanted - angle, -most, most);
  }

  // Ackermann: all wheels turn about one point beside the rear axle.
  static double angle_of(const Senses& senses, std::span<const double> values, std::size_t n) {
    const double middle = at(values, Value::kSteer);
    if (n >= 2 || middle == 0) return 0;
    const auto [sin, cos] = portable::sincos(middle);
    const double wheelbase = parameter(senses, Parameter::kWheelbase);
    const double to_centre = wheelbase * cos / sin - mount_of(senses, n).y();
    const double angle = portable::atan2(wheelbase, std::abs(to_centre));
    return to_centre < 0 ? -angle : angle;
  }

  static Wheel wheel_at(const Senses& senses, std::span<double> values, const Chassis& chassis,
                        std::size_t n) {
    Wheel wheel;
    double& compressed = values[static_cast<std::size_t>(Value::kSpring) + n];
    compressed = 0;
    const std::span<const ProgramFinding> hit = senses.of(static_cast<std::uint32_t>(n));
    if (hit.empty()) return wheel;
    wheel.ground = &hit.front();
    const Eigen::Quaterniond turn = senses.orientation();
    wheel.lever = Eigen::Vector3d(wheel.ground->point.data()) - senses.position();
    wheel.carried = Eigen::Vector3d(wheel.ground->velocity.data());
    wheel.normal = Eigen::Vector3d(wheel.ground->normal.data());
    const auto [sin, cos] = portable::sincos(angle_of(senses, values, n));
    const Eigen::Vector3d rolls = turn * Eigen::Vector3d(cos, sin, 0);
    wheel.left = wheel.normal.cross(rolls).normalized();
    wheel.forward = wheel.left.cross(wheel.normal);
    compressed = parameter(senses, Parameter::kTravel) + parameter(senses, Parameter::kRadius) -
                 wheel.ground->distance;
    load(senses, compressed, chassis, wheel);
    return wheel;
  }

  static void load(const Senses& senses, double compressed, const Chassis& chassis, Wheel& wheel) {
    const double sinking =
        -(senses.velocity() + senses.angular_velocity().cross(wheel.lever) - wheel.carried).dot(wheel.normal);
    const double force = parameter(senses, Parameter::kStiffness) * compressed +
                         parameter(senses, Parameter::kDamping) * sinking;
    // A damper stops what sinks, and does not throw it back.
    const double most = chassis.resistance(wheel.lever, wheel.normal) * std::max(sinking, 0.0) +
                        parameter(senses, Parameter::kStiffness) * compressed * senses.dt;
    wheel.load = std::clamp(force * senses.dt, 0.0, most);
    const bool front = wheel.lever.dot(senses.orientation() * Eigen::Vector3d::UnitX()) > 0;
    const double fronts = parameter(senses, Parameter::kFrontDrive) >= 0.5 ? 2 : 0;
    const double rears = parameter(senses, Parameter::kRearDrive) >= 0.5 ? 2 : 0;
    const double speed = (senses.velocity() - wheel.carried).dot(wheel.forward);
    const double throttle = input(senses, Input::kThrottle);
    const bool pushes = throttle * speed < std::abs(throttle) * parameter(senses, Parameter::kSpeed);
    if (pushes && (front ? fronts : rears) > 0)
      wheel.engine = throttle * parameter(senses, Parameter::kEngine) / (fronts + rears) * senses.dt;
    wheel.engine = std::clamp(wheel.engine, -parameter(senses, Parameter::kGrip) * wheel.load,
                              parameter(senses, Parameter::kGrip) * wheel.load);
    wheel.brake = input(senses, Input::kBrake) * parameter(senses, Parameter::kBrake) * senses.dt;
    // What neither drives nor brakes still rolls to a stand.
    if (throttle == 0)
      wheel.brake = std::max(wheel.brake, parameter(senses, Parameter::kRolling) * wheel.load);
  }

  static void push(Chassis& chassis, Wheel& wheel, const Eigen::Vector3d& by) {
    chassis.push(wheel.lever, by);
    wheel.given += by;
  }

  // The tyre holds its point: to the side as far as it grips, along its way as far as it is braked.
  static void hold(Chassis& chassis, Wheel& wheel, double grip) {
    const Eigen::Vector3d slip = chassis.velocity_at(wheel.lever) - wheel.carried;
    Eigen::Vector2d next = wheel.tyre;
    next.x() -= chassis.resistance(wheel.lever, wheel.forward) * slip.dot(wheel.forward);
    next.x() = std::clamp(next.x(), -wheel.brake, wheel.brake);
    next.y() -= chassis.resistance(wheel.lever, wheel.left) * slip.dot(wheel.left);
    // The engine takes its part of the grip.
    const Eigen::Vector2d all(next.x() + wheel.engine, next.y());
    const double most = grip * wheel.load;
    if (const double length = all.norm(); length > most) {
      next = all * (most / length);
      next.x() -= wheel.engine;
    }
    const Eigen::Vector2d change = next - wheel.tyre;
    wheel.tyre = next;
    push(chassis, wheel, wheel.forward * change.x() + wheel.left * change.y());
  }

  static void note(const Senses& senses, const std::array<Wheel, kWheels>& wheels, std::span<double> values) {
    double on_ground = 0;
    Eigen::Vector3d carried = Eigen::Vector3d::Zero();
    for (const Wheel& wheel : wheels) {
      if (wheel.ground == nullptr) continue;
      on_ground += 1;
      carried += wheel.carried;
    }
    if (on_ground > 0) carried /= on_ground;
    at(values, Value::kOnGround) = on_ground;
    at(values, Value::kSpeed) =
        (senses.velocity() - carried).dot(senses.orientation() * Eigen::Vector3d::UnitX());
  }

  static void act(const Senses& senses, const Chassis& chassis, const std::array<Wheel, kWheels>& wheels,
                  Actor& actor) {
    const Eigen::Vector3d force = chassis.impulse / senses.dt;
    const Eigen::Vector3d torque = chassis.spin / senses.dt;
    const auto moves = [](const Wheel& wheel) {
      return wheel.ground != nullptr && wheel.ground->motion != Motion::kStatic;
    };
    const bool is_driven = input(senses, Input::kThrottle) != 0;
    if (is_driven || std::ranges::any_of(wheels, moves)) {
      actor.push_awake(force, torque);
      actor.wake_in(1);
    } else {
      actor.push(force, torque);
    }
    for (const Wheel& wheel : wheels) {
      if (wheel.ground == nullptr || wheel.ground->motion != Motion::kDynamic) continue;
      actor.impulse(
          wheel.ground->body, -wheel.given,
          Eigen::Vector3d(wheel.ground->point.data()) - Eigen::Vector3d(wheel.ground->position.data()));
    }
  }
};

}  // namespace
}  // namespace vehicle

const Program& vehicle_program() {
  static const vehicle::Vehicle kVehicle;
  return kVehicle;
}

}  // namespace tessera
