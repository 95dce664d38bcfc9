// Scene 4: mechanisms with joints.
#include <absl/strings/str_cat.h>

#include <cmath>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

constexpr double kGapMore = 1e-3;  // m, more than the reference

bool joints_hold(const Course& run, const Course& reference) {
  return run.joint_gap_max <= reference.joint_gap_max + kGapMore;
}

// 10 m of links, fixed to the world at one end, that start horizontal and swing down.
WorldDescription chain(const WorldSettings& settings) { return chain_world(settings, 20, {-5, 0.013, 4}); }

// A door of 1 x 2 m on a hinge at the seam, swinging towards its stop.
WorldDescription door(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  BodyDescription& leaf = builder.add("leaf", builder.shape(Box{{1, 0.05, 2}}), 20, {0.5, 0, 0});
  leaf.angular_velocity.z() = 1.5;
  leaf.linear_velocity.y() = 0.75;
  JointDescription& hinge =
      builder.tie("hinge", JointType::kRevolute, "", "leaf", {0, 0, 0}, Eigen::Vector3d::UnitZ());
  hinge.properties.axes[0].lower = -2;
  hinge.properties.axes[0].upper = 2;
  return builder.world();
}

// Two rods of 2 m, released at an angle.
WorldDescription double_pendulum(const WorldSettings& settings) {
  constexpr double kRod = 2;
  constexpr double kAngle = 1.1;  // rad from hanging
  WorldBuilder builder(settings);
  const ShapeId rod = builder.shape(Box{{0.1, 0.1, kRod}});
  const Eigen::Vector3d along(-std::sin(kAngle), 0, -std::cos(kAngle));
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d pivot = Eigen::Vector3d(0.013, 0, 2) + i * kRod * along;
    const std::string name = absl::StrCat("rod", i);
    builder.add(name, rod, 3, pivot + 0.5 * kRod * along).pose.orientation =
        Eigen::AngleAxisd(kAngle, Eigen::Vector3d::UnitY());
    builder.tie(absl::StrCat("pivot", i), JointType::kRevolute, i == 0 ? "" : "rod0", name, pivot,
                Eigen::Vector3d::UnitY());
  }
  return builder.world();
}

struct Limb {
  const char* name;
  const char* parent;
  Eigen::Vector3d centre;
  Eigen::Vector3d size;  // m, of a box
  Eigen::Vector3d joint;
  JointType type;
};

// A figure 1.8 m tall, astride the seam, that lands on its feet and falls over. The origin is where it
// stands.
WorldDescription figure(const WorldSettings& settings) {
  const Limb limbs[] = {
      {"torso", "", {0, 0, 1.2}, {0.25, 0.4, 0.6}, {}, JointType::kFixed},
      {"head", "torso", {0, 0, 1.66}, {0.2, 0.2, 0.24}, {0, 0, 1.52}, JointType::kBall},
      {"arm_left", "torso", {0, 0.32, 1.2}, {0.1, 0.1, 0.5}, {0, 0.28, 1.42}, JointType::kBall},
      {"arm_right", "torso", {0, -0.32, 1.2}, {0.1, 0.1, 0.5}, {0, -0.28, 1.42}, JointType::kBall},
      {"thigh_left", "torso", {0, 0.12, 0.67}, {0.14, 0.14, 0.4}, {0, 0.12, 0.88}, JointType::kBall},
      {"thigh_right", "torso", {0, -0.12, 0.67}, {0.14, 0.14, 0.4}, {0, -0.12, 0.88}, JointType::kBall},
      {"shin_left", "thigh_left", {0, 0.12, 0.23}, {0.1, 0.1, 0.4}, {0, 0.12, 0.45}, JointType::kRevolute},
      {"shin_right",
       "thigh_right",
       {0, -0.12, 0.23},
       {0.1, 0.1, 0.4},
       {0, -0.12, 0.45},
       JointType::kRevolute},
  };
  constexpr double kDensity = 1000;  // kg/m^3
  const Eigen::Vector3d fall(0.021, 0.013, 0.5);
  WorldBuilder builder(settings);
  builder.add_floor(50, 0);
  for (const Limb& limb : limbs) {
    builder.add(limb.name, builder.shape(Box{limb.size}), kDensity * limb.size.prod(), limb.centre + fall)
        .linear_velocity.x() = 0.5;
    if (*limb.parent == 0) continue;
    JointDescription& joint = builder.tie(absl::StrCat("to_", limb.name), limb.type, limb.parent, limb.name,
                                          limb.joint + fall, Eigen::Vector3d::UnitY());
    if (limb.type != JointType::kRevolute) continue;
    joint.properties.axes[0].lower = 0;
    joint.properties.axes[0].upper = 2.3;
  }
  for (BodyDescription& body : builder.world().bodies) {
    body.properties.assembly = body.properties.motion == Motion::kDynamic ? 1 : 0;
  }
  return builder.world();
}

Scene jointed(const std::string& name, const std::string& about, double sector_size,
              absl::StatusOr<WorldDescription> (*build)(const WorldSettings&)) {
  Scene scene;
  scene.name = name;
  scene.about = about;
  scene.sector_size = sector_size;
  scene.extent = 12;
  scene.lowest = -12;
  scene.solver_iterations = 30;
  scene.energy = EnergyRule::kNoGain;
  scene.build = build;
  scene.stands = joints_hold;
  return scene;
}

template <WorldDescription (*make)(const WorldSettings&)>
absl::StatusOr<WorldDescription> built(const WorldSettings& settings) {
  return make(settings);
}

}  // namespace

std::vector<Scene> joint_scenes() {
  return {
      jointed("chain", "a chain of 20 links swings through sectors of 4 m", 4, built<chain>),
      jointed("door", "a door on its hinge swings through the seam to its stop", 128, built<door>),
      jointed("figure", "a figure of 8 limbs falls astride the seam", 128, built<figure>),
      jointed("double_pendulum", "a double pendulum swings through the seam", 128, built<double_pendulum>),
  };
}

}  // namespace tessera::seams
