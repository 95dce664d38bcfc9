#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "experiments/joints/mechanism.h"
#include "lpss/simulation/example_mechanisms.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::mechanisms {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kGravity = 9.81;  // m/s^2, as in WorldSettings
constexpr double kRodWidth = 0.1;  // m
Box rod() { return Box{{1, kRodWidth, kRodWidth}}; }

WorldSettings without_gravity(WorldSettings settings) {
  settings.gravity = UniformGravity{Vector3d::Zero()};
  return settings;
}

// A rod of 1 m and 1 kg that a joint at its end holds out from the world.
WorldBuilder arm(const WorldSettings& settings, JointType type, const Vector3d& axis) {
  WorldBuilder builder(settings);
  builder.add("arm", builder.shape(rod()), 1, {0.5, 0, 0});
  builder.tie("joint", type, "", "arm", {0, 0, 0}, axis);
  return builder;
}

// A rod that turns about its own centre, or slides, without weight.
WorldBuilder wheel(const WorldSettings& settings, JointType type) {
  WorldBuilder builder(without_gravity(settings));
  builder.add("wheel", builder.shape(rod()), 1, {0, 0, 0});
  builder.tie("joint", type, "", "wheel", {0, 0, 0}, Vector3d::UnitZ());
  return builder;
}

// kg m^2, of a rod across its length.
constexpr double kWheel = (1 + kRodWidth * kRodWidth) / 12;

Mechanism hung(const std::string& name, JointType type, const Vector3d& axis, double pitch = 0) {
  Mechanism mechanism;
  mechanism.group = "joint";
  mechanism.name = name;
  mechanism.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = arm(settings, type, axis);
    builder.world().joints.front().properties.pitch = pitch;
    return builder.world();
  };
  mechanism.in_bullet = type != JointType::kScrew;
  return mechanism;
}

// Two rods of 1 m, released from the level.
WorldDescription double_pendulum(const WorldSettings& settings) {
  WorldBuilder builder = arm(settings, JointType::kRevolute, Vector3d::UnitY());
  builder.add("forearm", 0, 1, {1.5, 0, 0});
  builder.tie("elbow", JointType::kRevolute, "arm", "forearm", {1, 0, 0}, Vector3d::UnitY());
  return builder.world();
}

// Three rods that nothing holds, tied by balls; each spins by itself.
WorldDescription floating_chain(const WorldSettings& settings) {
  const Vector3d spins[] = {{0, -1, 1}, {0, 3, 2}, {0, 2, -3}};  // rad/s
  const Vector3d drift(0.3, 0, 0.1);                             // m/s
  WorldBuilder builder(without_gravity(settings));
  const ShapeId shape = builder.shape(rod());
  std::string last;
  for (int n = 0; n < 3; ++n) {
    const std::string name = absl::StrCat("rod", n);
    BodyDescription& body = builder.add(name, shape, 1, {n - 1.0, 0, 0});
    body.angular_velocity = spins[n];
    body.linear_velocity = drift + (spins[1] + spins[n]).cross(Vector3d((n - 1) / 2.0, 0, 0));
    if (n > 0) builder.tie(absl::StrCat("ball", n), JointType::kBall, last, name, {n - 1.5, 0, 0});
    last = name;
  }
  return builder.world();
}

std::vector<Mechanism> joint_mechanisms() {
  Mechanism slide = hung("prismatic", JointType::kPrismatic, {1, 0, -0.1});
  slide.seconds = 5;
  Mechanism screw = hung("screw", JointType::kScrew, Vector3d::UnitZ(), 0.02);
  Mechanism floating;
  floating.name = "floating_chain";
  floating.world = floating_chain;
  floating.is_free = true;
  Mechanism pendulum;
  pendulum.name = "double_pendulum";
  pendulum.world = double_pendulum;
  floating.group = pendulum.group = "joint";
  Mechanism fixed = hung("fixed", JointType::kFixed, Vector3d::UnitX());
  fixed.keeps_energy = false;  // it has none
  return {fixed,
          hung("pendulum", JointType::kRevolute, Vector3d::UnitY()),
          slide,
          hung("ball", JointType::kBall, Vector3d::UnitX()),
          hung("universal", JointType::kUniversal, Vector3d::UnitY()),
          screw,
          pendulum,
          floating};
}

// Links of 1 kg and 0.5 m, from the world at 45 degrees, with a ball of so many kg at their end.
WorldDescription loaded_chain(const WorldSettings& settings, double load) {
  constexpr int kLinks = 10;
  const Vector3d way = Vector3d(1, 0, -1).normalized();
  WorldBuilder builder(settings);
  const std::string last = builder.add_chain(kLinks, Vector3d::Zero(), way);
  const Vector3d end = kLinks * kChainLink * way;
  builder.add("load", builder.shape(Sphere{0.2}), load, end);
  builder.tie("hook", JointType::kBall, last, "load", end);
  return builder.world();
}

std::vector<Mechanism> chain_mechanisms() {
  std::vector<Mechanism> mechanisms;
  for (const int load : {1, 10, 100, 1000, 10000}) {
    Mechanism& mechanism = mechanisms.emplace_back();
    mechanism.name = absl::StrCat("load_", load);
    mechanism.world = [load](const WorldSettings& settings) { return loaded_chain(settings, load); };
  }
  Mechanism& whip = mechanisms.emplace_back();
  whip.name = "whip_of_60";
  whip.world = [](const WorldSettings& settings) { return chain_world(settings, 60, Vector3d::Zero()); };
  whip.has_reference = false;  // chaotic
  Mechanism& tree = mechanisms.emplace_back();
  tree.name = "tumbling_tree";
  tree.world = [](const WorldSettings& settings) { return tumbling_tree_world(settings, 1); };
  tree.has_reference = false;
  for (Mechanism& mechanism : mechanisms) mechanism.group = "chain";
  return mechanisms;
}

// Its crank starts at 4 rad/s, from where crank and rocker hang.
WorldDescription swinging_four_bar(const WorldSettings& settings) {
  constexpr double kSpeed = 4;  // rad/s
  WorldDescription world = four_bar_world(settings);
  BodyDescription& crank = world.bodies[0];
  BodyDescription& coupler = world.bodies[1];
  BodyDescription& rocker = world.bodies[2];  // twice as long
  crank.angular_velocity.y() = kSpeed;
  crank.linear_velocity.x() = -0.25 * kSpeed;
  coupler.linear_velocity.x() = -0.5 * kSpeed;
  rocker.linear_velocity.x() = -0.25 * kSpeed;
  rocker.angular_velocity.y() = 0.5 * kSpeed;
  return world;
}

std::vector<Mechanism> loop_mechanisms() {
  const auto loop = [](const std::string& name, std::function<WorldDescription(const WorldSettings&)> world) {
    Mechanism mechanism;
    mechanism.group = "loop";
    mechanism.name = name;
    mechanism.world = std::move(world);
    return mechanism;
  };
  Mechanism net = loop("net_of_900", [](const WorldSettings& s) { return net_world(s, 30, true); });
  net.seconds = 2;
  net.is_large = true;
  net.has_reference = false;
  return {loop("four_bar", swinging_four_bar),
          loop("bridge", [](const WorldSettings& s) { return bridge_world(s, 4); }),
          loop("flat_bridge", [](const WorldSettings& s) { return bridge_world(s, 0); }),
          loop("net_of_36", [](const WorldSettings& s) { return net_world(s, 6, true); }),
          loop("curtain_of_36", [](const WorldSettings& s) { return net_world(s, 6, false); }),
          net};
}

// The first joint's position when it is over.
double last_position(std::span<const Sighting> course) { return course.back().joints[0].position[0]; }

// The largest of `what` from `start` s on.
template <typename What>
double largest(std::span<const Sighting> course, double start, const What& what) {
  double most = 0;
  for (const Sighting& seen : course) {
    if (seen.time >= start) most = std::max(most, what(seen));
  }
  return most;
}

Mechanism motor() {
  Mechanism mechanism;
  mechanism.name = "motor_of_four_bar";
  mechanism.world = [](const WorldSettings& settings) {
    WorldDescription world = four_bar_world(settings);
    world.joints.front().drives[0] = {DriveMode::kVelocity, 6};
    return world;
  };
  mechanism.error_is = "speed after 1 s, relative";
  mechanism.error = [](std::span<const Sighting> course) {
    return largest(course, 1, [](const Sighting& s) { return std::abs(s.joints[0].velocity[0] / 6 - 1); });
  };
  return mechanism;
}

// A load of 1 kg on a winch of half the force that it takes: it sinks as fast as that lets it.
Mechanism stall() {
  constexpr double kForce = 0.5 * kGravity;
  Mechanism mechanism;
  mechanism.name = "motor_stalls";
  mechanism.seconds = 1;
  mechanism.world = [](const WorldSettings& settings) {
    WorldBuilder builder = arm(settings, JointType::kPrismatic, Vector3d::UnitZ());
    JointDescription& joint = builder.world().joints.front();
    joint.properties.axes[0].effort_max = kForce;
    joint.drives[0] = {DriveMode::kVelocity, 1};
    return builder.world();
  };
  mechanism.error_is = "speed, relative";
  mechanism.error = [](std::span<const Sighting> course) {
    const Sighting& last = course.back();
    return std::abs(last.joints[0].velocity[0] / ((kForce - kGravity) * last.time) - 1);
  };
  return mechanism;
}

// An arm that a position drive lifts by 0.3 rad and holds.
Mechanism position_drive() {
  Mechanism mechanism;
  mechanism.name = "position_drive";
  mechanism.world = [](const WorldSettings& settings) {
    WorldBuilder builder = arm(settings, JointType::kRevolute, -Vector3d::UnitY());
    builder.world().joints.front().drives[0] = {DriveMode::kPosition, 0.3};
    return builder.world();
  };
  mechanism.error_is = "angle at the end, rad";
  mechanism.error = [](std::span<const Sighting> course) { return std::abs(last_position(course) - 0.3); };
  return mechanism;
}

constexpr double kServoStiffness = 200;  // N m/rad
constexpr double kServoDamping = 20;     // N m s/rad

// An arm on a servo that gives way by its weight: stiffness * angle = - weight * lever * cos(angle).
Mechanism servo() {
  Mechanism mechanism;
  mechanism.name = "servo";
  mechanism.world = [](const WorldSettings& settings) {
    WorldBuilder builder = arm(settings, JointType::kRevolute, -Vector3d::UnitY());
    builder.world().joints.front().drives[0] = {DriveMode::kServo, 0, kServoStiffness, kServoDamping};
    return builder.world();
  };
  mechanism.error_is = "angle at the end, rad";
  mechanism.error = [](std::span<const Sighting> course) {
    double sag = 0;
    for (int n = 0; n < 20; ++n) sag = -kGravity * 0.5 * std::cos(sag) / kServoStiffness;
    return std::abs(last_position(course) - sag);
  };
  return mechanism;
}

// The same arm without weight, whose target swings by 0.5 rad at 0.5 Hz. A tick is given the target at its
// end.
Mechanism tracking() {
  const auto target = [](double time) { return 0.5 * std::sin(pi * time); };
  Mechanism mechanism;
  mechanism.name = "servo_tracks";
  mechanism.world = [](const WorldSettings& settings) {
    return arm(without_gravity(settings), JointType::kRevolute, Vector3d::UnitY()).world();
  };
  mechanism.drive = [target](double time) {
    return JointDrive{DriveMode::kServo, target(time), kServoStiffness, kServoDamping,
                      0.5 * pi * std::cos(pi * time)};
  };
  mechanism.error_is = "angle after 2 s, rad";
  mechanism.error = [target](std::span<const Sighting> course) {
    return largest(course, 2,
                   [&](const Sighting& s) { return std::abs(s.joints[0].position[0] - target(s.time)); });
  };
  return mechanism;
}

// A wheel or slide on a spring, 0.3 from its rest: a period of 1 s.
Mechanism spring(JointType type, double seconds) {
  constexpr double kAmplitude = 0.3;  // rad or m
  const double mass = type == JointType::kPrismatic ? 1 : kWheel;
  Mechanism mechanism;
  mechanism.name = type == JointType::kPrismatic ? "spring_slides" : "spring_turns";
  mechanism.seconds = seconds;
  mechanism.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = wheel(settings, type);
    JointAxis& axis = builder.world().joints.front().properties.axes[0];
    axis.spring_stiffness = 4 * pi * pi * mass;
    axis.spring_reference = kAmplitude;
    return builder.world();
  };
  mechanism.error_is = "amplitude at the end, relative";
  mechanism.error = [=](std::span<const Sighting> course) {
    const double most = largest(course, seconds - 2, [](const Sighting& s) {
      return std::abs(s.joints[0].position[0] - kAmplitude);
    });
    return std::abs(most / kAmplitude - 1);
  };
  return mechanism;
}

// An arm that falls by 0.5 rad onto its limit.
Mechanism limit() {
  Mechanism mechanism;
  mechanism.name = "limit";
  mechanism.seconds = 5;
  mechanism.world = [](const WorldSettings& settings) {
    WorldBuilder builder = arm(settings, JointType::kRevolute, Vector3d::UnitY());
    builder.world().joints.front().properties.axes[0].upper = 0.5;
    return builder.world();
  };
  mechanism.error_is = "angle beyond it, rad";
  mechanism.error = [](std::span<const Sighting> course) {
    return largest(course, 0, [](const Sighting& s) { return s.joints[0].position[0] - 0.5; });
  };
  return mechanism;
}

// Two wheels with gears of 1:3, the first of which a motor turns.
Mechanism gears() {
  constexpr double kRatio = -3;
  Mechanism mechanism;
  mechanism.name = "gears";
  mechanism.in_bullet = false;
  mechanism.world = [](const WorldSettings& settings) {
    WorldBuilder builder = wheel(settings, JointType::kRevolute);
    builder.add("pinion", 0, 1, {0, 0, 1});
    builder.tie("pinion_joint", JointType::kRevolute, "", "pinion", {0, 0, 1}, Vector3d::UnitZ());
    WorldDescription& world = builder.world();
    world.joints[0].drives[0] = {DriveMode::kVelocity, 2};
    world.joints[1].properties.axes[0].mimic = {JointId{1}, 0, kRatio, 0, 0};
    return world;
  };
  mechanism.error_is = "angle of the pinion, rad";
  mechanism.error = [](std::span<const Sighting> course) {
    return largest(course, 0, [](const Sighting& s) {
      return std::abs(std::remainder(s.joints[1].position[0] - kRatio * s.joints[0].position[0], 2 * pi));
    });
  };
  return mechanism;
}

std::vector<Mechanism> drive_mechanisms() {
  std::vector<Mechanism> mechanisms = {motor(),
                                       stall(),
                                       position_drive(),
                                       servo(),
                                       tracking(),
                                       spring(JointType::kRevolute, 60),
                                       spring(JointType::kPrismatic, 60),
                                       limit(),
                                       gears()};
  for (Mechanism& mechanism : mechanisms) {
    mechanism.group = "drive";
    mechanism.keeps_energy = false;
    mechanism.has_reference = false;
  }
  return mechanisms;
}

}  // namespace

std::vector<Mechanism> all_mechanisms() {
  std::vector<Mechanism> all;
  for (const auto& mechanisms : {joint_mechanisms, chain_mechanisms, loop_mechanisms, drive_mechanisms}) {
    std::vector<Mechanism> more = mechanisms();
    std::move(more.begin(), more.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace tessera::mechanisms
