// Loops of joints: rows that follow from each other, and systems near to where they could not move at all.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/observe/mechanics.h"
#include "lpss/simulation/example_mechanisms.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

WorldSettings settings_of(double sector_size) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  return settings;
}

// Its crank turns at 6 rad/s.
WorldDescription driven_four_bar(const WorldSettings& settings) {
  WorldDescription world = four_bar_world(settings);
  world.joints.front().drives[0] = {DriveMode::kVelocity, 6};
  return world;
}

WorldDescription hung_chain(const WorldSettings& settings) { return bridge_world(settings, 4); }
WorldDescription flat_bridge(const WorldSettings& settings) { return bridge_world(settings, 0); }
WorldDescription flat_net(const WorldSettings& settings) {
  return net_world(settings, 6, /*at_corners=*/true);
}
WorldDescription curtain(const WorldSettings& settings) {
  return net_world(settings, 6, /*at_corners=*/false);
}

// What a world shows while it runs.
Mechanics look(const PartitionCluster& cluster, const WorldDescription& world, MechanicsOfWorld& mechanics) {
  std::vector<BodyRecord> bodies;
  for (std::uint64_t id = 1; id <= world.bodies.size(); ++id) bodies.push_back(*cluster.body(BodyId{id}));
  return mechanics.at(bodies, world.settings.time_step / world.settings.substeps / 2);
}

struct LoopCase {
  const char* name;
  WorldDescription (*world)(const WorldSettings&);
  int substeps;  // fixed; 0: as many as the world needs
  bool is_driven;

  WorldSettings settings() const {
    WorldSettings settings = settings_of(128);
    if (substeps > 0) {
      settings.substeps = substeps;
      settings.adapt = false;
    }
    return settings;
  }

  friend void PrintTo(const LoopCase& c, std::ostream* out) { *out << c.name << "Substeps" << c.substeps; }
};

std::vector<LoopCase> loop_cases() {
  std::vector<LoopCase> cases;
  for (const int substeps : {0, 1, 4, 64}) {
    cases.push_back({"FourBar", driven_four_bar, substeps, true});
    cases.push_back({"HungChain", hung_chain, substeps, false});
    cases.push_back({"FlatBridge", flat_bridge, substeps, false});
    cases.push_back({"FlatNet", flat_net, substeps, false});
    cases.push_back({"Curtain", curtain, substeps, false});
  }
  return cases;
}

// What one run of a world showed.
struct Course {
  double gap = 0;     // m
  double moved = 0;   // J
  double gained = 0;  // J
};

Course course_of(const WorldDescription& world) {
  auto cluster = cluster_of(world, 1);
  MechanicsOfWorld mechanics = MechanicsOfWorld::create(world).value();
  const double start = look(*cluster, world, mechanics).energy();
  Course course;
  constexpr int kTicks = 240;
  for (int tick = 0; tick < kTicks; ++tick) {
    cluster->step();
    const Mechanics now = look(*cluster, world, mechanics);
    course.moved = std::max(course.moved, now.kinetic);
    course.gap = std::max(course.gap, now.gap);
    course.gained = std::max(course.gained, now.energy() - start);
    if (!std::isfinite(now.energy())) {
      ADD_FAILURE() << "tick " << tick;
      break;
    }
  }
  return course;
}

class LoopTest : public testing::TestWithParam<LoopCase> {};

// Nets are chaotic: starts that differ by rounding errors go apart, and one in twenty folds so that a joint
// opens by more than most do, and that a tick in one step gains a few percent of energy. So a few starts are
// looked at.
TEST_P(LoopTest, HoldsAndGainsNoEnergy) {
  const LoopCase& param = GetParam();
  const int starts = param.substeps == 64 ? 1 : 5;
  std::mt19937 random(7);
  std::vector<double> gaps;
  std::vector<double> gains;  // of what bounds them
  for (int start = 0; start < starts; ++start) {
    WorldDescription world = param.world(param.settings());
    for (BodyDescription& body : world.bodies) body.linear_velocity.x() += 1e-19 * random();
    const Course course = course_of(world);
    gaps.push_back(course.gap);
    gains.push_back(course.gained / (0.01 * course.moved + 0.01));
  }
  std::ranges::sort(gaps);
  std::ranges::sort(gains);
  if (!param.is_driven) {
    EXPECT_LT(gains[gains.size() / 2], 1);
    EXPECT_LT(gains.back(), param.substeps == 1 ? 4 : 1);
  }
  const double gap_max = param.substeps == 1 ? 0.05 : 0.002;
  EXPECT_LT(gaps[gaps.size() / 2], gap_max);
  EXPECT_LT(gaps.back(), 4 * gap_max);
}

INSTANTIATE_TEST_SUITE_P(Loops, LoopTest, testing::ValuesIn(loop_cases()), testing::PrintToStringParamName());

TEST(Loops, TheMotorTurnsItsCrankForEver) {
  const WorldDescription world = driven_four_bar(settings_of(128));
  auto cluster = cluster_of(world, 1);
  for (int tick = 0; tick < 1200; ++tick) {
    cluster->step();
    if (tick < 60) continue;
    const BodyState crank = cluster->body(BodyId{1})->state;
    ASSERT_NEAR(Eigen::Vector3d(crank.angular_velocity.data()).norm(), 6, 0.01) << "tick " << tick;
  }
}

// Not a loop, but taut, too: links of 1 kg that swing with a load.
TEST(Loads, AChainSwingsWithTenThousandTimesTheMassOfALink) {
  constexpr double kLoad = 1e4;  // kg
  const Eigen::Vector3d way = Eigen::Vector3d(1, 0, -1).normalized();
  WorldBuilder builder(settings_of(128));
  const std::string last = builder.add_chain(10, Eigen::Vector3d::Zero(), way);
  const Eigen::Vector3d end = 10 * kChainLink * way;
  builder.add("load", builder.shape(Sphere{0.2}), kLoad, end);
  builder.tie("hook", JointType::kBall, last, "load", end);
  const WorldDescription& world = builder.world();
  auto cluster = cluster_of(world, 1);
  MechanicsOfWorld mechanics = MechanicsOfWorld::create(world).value();
  for (int tick = 0; tick < 240; ++tick) {
    cluster->step();
    ASSERT_LT(look(*cluster, world, mechanics).gap, 1e-5) << "tick " << tick;
  }
  EXPECT_EQ(first_difference(run(world, 1, 1, 60), run(world, 3, 1, 60)), 60u);
}

// The foot of a robot: a crank and the foot, which a rod keeps parallel. The rod's hinge is a little out of
// line, so that the loop jams after a few degrees; the limit of the foot asks for more.
WorldDescription jammed_foot(const WorldSettings& settings) {
  constexpr double kTurned = 0.017;  // rad, of crank and foot against the line through their hinges
  constexpr double kTilt = 0.1;      // rad, of the rod's hinge
  const Eigen::Vector3d ankle(0, 0, -0.35);
  const Eigen::Vector3d arm = 0.055 * Eigen::Vector3d(std::sin(kTurned), 0, -std::cos(kTurned));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-kTurned, Eigen::Vector3d::UnitY()));
  WorldBuilder builder(settings);
  const ShapeId lever = builder.shape(Box{{0.03, 0.03, 0.055}});
  builder.add("crank", lever, 0.126, arm / 2).pose.orientation = turn;
  builder.add("foot", lever, 0.15, ankle + arm / 2).pose.orientation = turn;
  builder.add("rod", builder.shape(Box{{0.01, 0.01, 0.35}}), 0.12, arm + ankle / 2);
  builder.tie("crank_hinge", JointType::kRevolute, "", "crank", {0, 0, 0}, Eigen::Vector3d::UnitY());
  builder.tie("rod_hinge", JointType::kRevolute, "crank", "rod", arm, {0, std::cos(kTilt), std::sin(kTilt)});
  builder.tie("rod_ball", JointType::kBall, "rod", "foot", arm + ankle);
  builder.tie("ankle", JointType::kRevolute, "", "foot", ankle, Eigen::Vector3d::UnitY());
  builder.world().joints.back().properties.axes[0].upper = -0.6;
  return builder.world();
}

TEST(Loops, AJammedOneIsNotForcedByItsLimits) {
  const WorldDescription world = jammed_foot(settings_of(128));
  auto cluster = cluster_of(world, 1);
  MechanicsOfWorld mechanics = MechanicsOfWorld::create(world).value();
  for (int tick = 0; tick < 600; ++tick) {
    cluster->step();
    const Mechanics now = look(*cluster, world, mechanics);
    ASSERT_LT(now.gap, 0.0005) << "tick " << tick;
    ASSERT_LT(now.kinetic, 0.1) << "tick " << tick;
  }
}

TEST(Trees, ThatTumbleGainNoEnergy) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    for (const int substeps : {4, 16}) {
      WorldSettings settings = settings_of(128);
      settings.substeps = substeps;
      const Course course = course_of(tumbling_tree_world(settings, seed));
      EXPECT_LT(course.gained, 0.05 * course.moved) << "seed " << seed << ", " << substeps << " substeps";
      EXPECT_LT(course.gap, 0.001) << "seed " << seed << ", " << substeps << " substeps";
    }
  }
}

TEST(Loops, AreTheSameOnAnyNumberOfPartitions) {
  for (auto* const make : {hung_chain, flat_net, curtain}) {
    const WorldDescription world = make(settings_of(3));
    const std::vector<WorldHash> one = run(world, 1, 1, 120);
    EXPECT_EQ(first_difference(one, run(world, 2, 1, 120)), 120u);
    EXPECT_EQ(first_difference(one, run(world, 4, 2, 120)), 120u);
  }
}

}  // namespace
}  // namespace tessera
