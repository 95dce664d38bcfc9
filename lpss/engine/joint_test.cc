// Joints: what they hold, what they leave free, and over how many sectors.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "lpss/engine/joint_scene.h"

namespace tessera::engine_tests {
namespace {

using Eigen::Vector3d;

Vector3d position_of(const BodyState& state) { return Eigen::Map<const Vector3d>(state.position.data()); }

// The largest errors of joints while a scene runs.
struct Worst {
  double gap = 0;
  double twist = 0;
};

Worst run(JointScene& scene, double seconds, std::size_t joints = 1) {
  Worst worst;
  for (int tick = 0; tick < std::lround(seconds / kTick); ++tick) {
    scene.step();
    for (std::size_t n = 0; n < joints; ++n) {
      worst.gap = std::max(worst.gap, scene.joint_state(n).gap);
      worst.twist = std::max(worst.twist, scene.joint_state(n).twist);
    }
  }
  return worst;
}

// One link that hangs from the world by a joint half a metre beside its centre.
struct Hung {
  const char* name;
  JointType type;
  Vector3d axis;
  double way;  // m, at least, that it comes from where it was

  friend void PrintTo(const Hung& hung, std::ostream* out) { *out << hung.name; }
};

class HungTest : public testing::TestWithParam<Hung> {};

TEST_P(HungTest, HoldsWhatItTiesAndLeavesTheRest) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const Vector3d start(0.5, 0, 0);
  scene.add(ghost(kLink, start));
  const std::size_t joint = scene.tie(GetParam().type, 0, kLink, frame_at({0, 0, 0}, GetParam().axis));
  scene.joint(joint).pitch = 0.02;
  double way = 0;
  for (int tick = 0; tick < 600; ++tick) {
    scene.step();
    ASSERT_LT(scene.joint_state(joint).gap, 0.0015) << "tick " << tick;
    ASSERT_LT(scene.joint_state(joint).twist, 0.001) << "tick " << tick;
    way = std::max(way, (position_of(scene.state(kLink)) - start).norm());
  }
  EXPECT_GE(way, GetParam().way);
  EXPECT_TRUE(GetParam().way > 0 || way < 0.001) << way;
}

INSTANTIATE_TEST_SUITE_P(Types, HungTest,
                         testing::Values(Hung{"Fixed", JointType::kFixed, {1, 0, 0}, 0},
                                         Hung{"Revolute", JointType::kRevolute, {0, 1, 0}, 0.99},
                                         Hung{"Prismatic", JointType::kPrismatic, {1, 0, -0.01}, 4},
                                         Hung{"Ball", JointType::kBall, {1, 0, 0}, 0.99},
                                         Hung{"Universal", JointType::kUniversal, {0, 1, 0}, 0.99},
                                         Hung{"Screw", JointType::kScrew, {0, 0, 1}, 0.99}),
                         testing::PrintToStringParamName());

TEST(JointTest, AScrewGoesAsFarAsItIsTurned) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  scene.add(ghost(kLink, {0, 0, 0}));
  const std::size_t screw = scene.tie(JointType::kScrew, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
  scene.joint(screw).pitch = 0.1;
  scene.drive(screw) = {DriveMode::kVelocity, 2};
  run(scene, 10);
  // Three turns and more: 20 rad.
  EXPECT_NEAR(scene.state(kLink).position[2], 2, 0.01);
  EXPECT_NEAR(scene.state(kLink).linear_velocity[2], 0.2, 1e-4);
}

TEST(JointTest, AScrewIsTurnedByWhatPullsAlongIt) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  scene.add(ghost(kLink, {0, 0, 0}));
  const std::size_t screw = scene.tie(JointType::kScrew, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
  scene.joint(screw).pitch = -0.1;
  run(scene, 1);
  const double acceleration = 9.81 * 0.1 / (1.0 / 6 + 0.1 * 0.1);  // m g p / (I + m p^2)
  EXPECT_NEAR(scene.joint_state(screw).velocity[0], acceleration, 0.01 * acceleration);
}

TEST(JointTest, AKinematicParentCarriesItsChild) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  BodyRecord carrier = ghost(kBase, {0, 0, 0});
  carrier.properties.motion = Motion::kKinematic;
  carrier.state.linear_velocity = {1, 0, 0};
  carrier.state.angular_velocity = {0, 0, 2};
  scene.add(carrier);
  BodyRecord link = ghost(kLink, {0.5, 0, 0});
  link.state.linear_velocity = {1, 1, 0};
  link.state.angular_velocity = {0, 0, 2};
  scene.add(link);
  const std::size_t joint = scene.tie(JointType::kFixed, kBase, kLink, frame_at({0.25, 0, 0}));
  double gap = 0;
  double twist = 0;
  for (int tick = 1; tick <= 600; ++tick) {
    scene.step();
    BodyState state = scene.state(kBase);
    EXPECT_EQ(state.linear_velocity, carrier.state.linear_velocity);
    state.position[0] = tick * kTick;
    state.rotation = rotation_of(Eigen::Quaterniond(Eigen::AngleAxisd(2 * tick * kTick, Vector3d::UnitZ())));
    scene.set_state(kBase, state);
    gap = std::max(gap, scene.joint_state(joint).gap);
    twist = std::max(twist, scene.joint_state(joint).twist);
  }
  EXPECT_LT(gap, 0.001);
  EXPECT_LT(twist, 0.001);
}

TEST(JointTest, HoldsTheHeaviestBodies) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  BodyRecord ship = ghost(kLink, {20, 0, 0});
  ship.properties.mass = 1e6;
  ship.properties.inertia = {1e8, 4e8, 4e8};
  scene.add(ship);
  scene.tie(JointType::kFixed, 0, kLink, frame_at({0, 0, 0}));
  const Worst worst = run(scene, 5);
  EXPECT_LT(worst.gap, 0.01);
  EXPECT_LT(worst.twist, 0.001);
}

TEST(JointTest, HoldsAFastWheelWhileTheCarTurns) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  BodyRecord car = ghost(kBase, {0, 0, 0});
  car.properties.mass = 1000;
  car.properties.inertia = {1000, 1000, 1000};
  car.state.angular_velocity = {0, 0, 1};
  scene.add(car, 0, kNoGravity);
  BodyRecord wheel = ghost(kLink, {0.5, 0, 0});
  wheel.state.linear_velocity = {0, 0.5, 0};
  wheel.state.angular_velocity = {40, 0, 1};
  scene.add(wheel, 0, kNoGravity);
  scene.tie(JointType::kRevolute, kBase, kLink, frame_at({0.5, 0, 0}));
  const Worst worst = run(scene, 5);
  EXPECT_LT(worst.gap, 0.0005);
  EXPECT_LT(worst.twist, 0.003);
  EXPECT_NEAR(scene.joint_state(0).velocity[0], 40, 0.4);
}

// A chain of ten links with a joint between any two, from the world down to the right. With more sectors,
// every joint is between two of them.
void add_chain(JointScene& scene, int sectors) {
  const Vector3d along(std::sqrt(0.75), 0, -0.5);
  for (int i = 0; i < 10; ++i) {
    const auto id = kLink + static_cast<std::uint64_t>(i);
    scene.add(ghost(id, along * (i + 0.5)), i % sectors);
    const JointType type = i % 2 == 0 ? JointType::kRevolute : JointType::kBall;
    scene.tie(type, i == 0 ? 0 : id - 1, id, frame_at(along * i, {0, 1, 0}));
  }
}

TEST(JointTest, AChainHoldsTogether) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  add_chain(scene, 1);
  const Worst worst = run(scene, 10, 10);
  RecordProperty("gap_mm", std::to_string(1000 * worst.gap));
  EXPECT_LT(worst.gap, 0.025);
  EXPECT_LT(worst.twist, 0.001);
}

// The end of a chain that falls from the level turns by a radian and more in a tick as it cracks.
TEST(JointTest, AWhipHoldsTogether) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  constexpr std::size_t kLinks = 20;
  for (std::size_t i = 0; i < kLinks; ++i) {
    const auto x = static_cast<double>(i);
    scene.add(ghost(kLink + i, {x + 0.5, 0, 0}));
    scene.tie(JointType::kBall, i == 0 ? 0 : kLink + i - 1, kLink + i, frame_at({x, 0, 0}));
  }
  const Worst worst = run(scene, 10, kLinks);
  RecordProperty("gap_mm", std::to_string(1000 * worst.gap));
  EXPECT_LT(worst.gap, 0.004);
}

TEST(JointTest, AFastPairDoesNotPassAFloorAndStaysInOnePiece) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  scene.add(static_body(1, kFloorShape, {0, 0, -1}));
  for (const std::uint64_t id : {kBase, kLink}) {
    BodyRecord box = dynamic_body(id, kBoxShape, {0, 0, id == kBase ? 40.0 : 41.5});
    box.state.linear_velocity = {0, 0, -300};
    scene.add(box);
  }
  scene.tie(JointType::kFixed, kBase, kLink, frame_at({0, 0, 40.75}));
  for (int tick = 0; tick < 120; ++tick) {
    scene.step();
    EXPECT_LT(scene.joint_state(0).gap, 0.003);
    EXPECT_GT(scene.state(kBase).position[2], 0.3);
    EXPECT_GT(scene.state(kLink).position[2], 0.3);
  }
}

TEST(JointTest, AChainOverSectorsSwingsAsInOne) {
  const auto engine = test_engine(test_settings());
  JointScene one(*engine, 1);
  JointScene two(*engine, 2);
  JointScene ten(*engine, 10);
  add_chain(one, 1);
  add_chain(two, 2);
  add_chain(ten, 10);
  for (JointScene* scene : {&one, &two, &ten}) run(*scene, 10);
  const Vector3d end = position_of(one.state(kLink + 9));
  // What differs is the rounding of positions, the coarser the farther from a sector's centre: up to 1.2 km
  // here.
  const double tolerance = test_precision == Precision::kFloat32 ? 0.003 : 1e-9;
  EXPECT_LT((position_of(two.state(kLink + 9)) - end).norm(), tolerance);
  EXPECT_LT((position_of(ten.state(kLink + 9)) - end).norm(), tolerance);
}

TEST(JointTest, AHingeBetweenTwoSectorsSwingsAsInOne) {
  const auto engine = test_engine(test_settings());
  JointScene one(*engine, 1);
  JointScene two(*engine, 2);
  for (JointScene* scene : {&one, &two}) {
    // Half way between the centres of two sectors: both are 64 m away.
    BodyRecord base = ghost(kBase, {63.75, 0, 0});
    base.properties.mass = 100;
    base.properties.inertia = {10, 10, 10};
    scene->add(base, 0, kNoGravity);
    scene->add(ghost(kLink, {64.25, 0, 0}), scene == &two ? 1 : 0);
    scene->tie(JointType::kRevolute, kBase, kLink, frame_at({64, 0, 0}, {0, 1, 0}));
    run(*scene, 10);
  }
  const double tolerance = test_precision == Precision::kFloat32 ? 0.0003 : 1e-10;
  for (std::uint64_t id : {kBase, kLink}) {
    EXPECT_LT((position_of(one.state(id)) - position_of(two.state(id))).norm(), tolerance);
  }
  EXPECT_NEAR(one.joint_state(0).position[0], two.joint_state(0).position[0], tolerance);
}

TEST(JointTest, ASolverRemembersNothing) {
  const auto engine = test_engine(test_settings());
  JointScene alone(*engine);
  JointScene beside(*engine);
  JointScene other(*engine);
  add_chain(alone, 1);
  add_chain(beside, 1);
  other.add(static_body(1, kFloorShape, {0, 0, -1}));
  other.add(dynamic_body(2, kBoxShape, {0, 0, 0.5}));
  other.add(dynamic_body(3, kBoxShape, {0.1, 0, 1.5}));
  other.tie(JointType::kScrew, 0, 3, frame_at({0, 0, 3}, {0, 0, 1}));
  const auto solver = engine->make_solver();
  for (int tick = 0; tick < 120; ++tick) {
    alone.step();
    other.step(*solver);
    beside.step(*solver);
    ASSERT_EQ(alone.hash(), beside.hash()) << "tick " << tick;
  }
}

// A foot of 1 kg that bears 60 kg over an ankle that gives way: what the ground bears then is found at once,
// however much that is, and takes no more steps than usual. Not so on a light box, which no joint holds.
TEST(JointTest, AFootOnTheGroundAsksForNoMoreSteps) {
  const auto engine = test_engine(test_settings());
  const auto most_asked = [&](bool on_a_box) {
    JointScene scene(*engine);
    scene.add(static_body(1, kFloorShape, {0, 0, -1}));
    if (on_a_box) scene.add(dynamic_body(2, kBoxShape, {0, 0, 0.5}));
    const double bottom = on_a_box ? 1 : 0;
    scene.add(dynamic_body(kBase, kBoxShape, {0, 0, bottom + 0.5}));
    BodyRecord load = ghost(kLink, {0, 0, bottom + 1.5});
    load.properties.mass = 60;
    load.properties.inertia = {10, 10, 10};
    scene.add(load);
    const std::size_t ankle =
        scene.tie(JointType::kRevolute, kBase, kLink, frame_at({0, 0, bottom + 1}, {0, 1, 0}));
    scene.drive(ankle) = {DriveMode::kServo, 0, 1000, 100};
    scene.run(0.5);
    EXPECT_NEAR(scene.state(kLink).position[2], bottom + 1.5, 0.01) << "it stands";
    std::uint16_t most = 0;
    for (const ContactPair& pair : scene.world().contacts()) {
      if (pair.b.value == kBase) most = std::max(most, pair.substeps);
    }
    return int{most};
  };
  const int usual = test_settings().substeps;
  EXPECT_LE(most_asked(/*on_a_box=*/false), usual);
  EXPECT_GT(most_asked(/*on_a_box=*/true), usual);
}

}  // namespace
}  // namespace tessera::engine_tests
