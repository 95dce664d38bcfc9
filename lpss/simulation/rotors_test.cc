// Bodies that turn about an axis of symmetry by radians in a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "lpss/base/rotation.h"
#include "lpss/engine/test_world.h"
#include "lpss/observe/mechanics.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

struct Flywheel {
  double spin;        // rad/s
  double frame_mass;  // kg; the wheel has 0.5
  bool wheel_is_child;

  friend void PrintTo(const Flywheel& wheel, std::ostream* out) {
    *out << "Spin" << wheel.spin << (wheel.frame_mass < 1 ? "LightFrame" : "")
         << (wheel.wheel_is_child ? "" : "Parent");
  }
};

// A wheel on a frame that floats in space and turns by 1.1 rad/s, nearly across the wheel's axis.
WorldDescription flywheel_world(const Flywheel& flywheel, double time_step) {
  WorldBuilder builder(sectors_of(128));
  WorldSettings& settings = builder.world().settings;
  settings.precision = engine_tests::test_precision;
  settings.time_step = time_step;
  settings.gravity = UniformGravity{Vector3d::Zero()};
  const Vector3d turn(1, 0.2, 0.5);
  const Vector3d place(0, 0, 0.2);
  BodyDescription& frame =
      builder.add("frame", builder.shape(Box{{0.4, 0.3, 0.2}}), flywheel.frame_mass, {0, 0, 0});
  frame.angular_velocity = turn;
  BodyDescription& wheel = builder.add("wheel", builder.shape(Cylinder{0.1, 0.05}), 0.5, place);
  wheel.angular_velocity = turn + flywheel.spin * Vector3d::UnitZ();
  wheel.linear_velocity = turn.cross(place);
  const auto tie = [&](const char* parent, const char* child) {
    builder.tie("axle", JointType::kRevolute, parent, child, place, Vector3d::UnitZ());
  };
  flywheel.wheel_is_child ? tie("frame", "wheel") : tie("wheel", "frame");
  return builder.world();
}

// What two seconds of a world showed.
struct SpinCourse {
  double gap = 0;       // m
  double energy = 0;    // by which it has changed, as a share of it
  double momentum = 0;  // likewise, of the angular one
  Eigen::Quaterniond frame;
};

SpinCourse spin_course_of(const WorldDescription& world) {
  auto cluster = cluster_of(world, 1);
  MechanicsOfWorld mechanics = MechanicsOfWorld::create(world).value();
  const auto look = [&] {
    return mechanics.at(std::vector{*cluster->body(BodyId{1}), *cluster->body(BodyId{2})});
  };
  const Mechanics start = look();
  SpinCourse course;
  const auto ticks = std::lround(2 / world.settings.time_step);
  for (int tick = 0; tick < ticks; ++tick) {
    cluster->step();
    const Mechanics now = look();
    const auto note = [](double& most, double value) { most = std::max(most, value); };
    note(course.gap, now.gap);
    note(course.energy, std::abs(now.energy() / start.energy() - 1));
    note(course.momentum,
         (now.angular_momentum - start.angular_momentum).norm() / start.angular_momentum.norm());
  }
  course.frame = quaternion_of(cluster->body(BodyId{1})->state);
  return course;
}

class FlywheelTest : public testing::TestWithParam<Flywheel> {};

TEST_P(FlywheelTest, TurnsItsFrameAsInShortSteps) {
  const SpinCourse course = spin_course_of(flywheel_world(GetParam(), 1.0 / 60));
  EXPECT_LT(course.gap, 1e-7);
  EXPECT_LT(course.energy, 3e-6);
  EXPECT_LT(course.momentum, 0.006);  // of the end of a step, while that of its middle stays
  WorldDescription in_short_steps = flywheel_world(GetParam(), 1.0 / 960);
  in_short_steps.settings.substeps = 64;
  in_short_steps.settings.adapt = false;
  const Eigen::Quaterniond off = course.frame * spin_course_of(in_short_steps).frame.conjugate();
  EXPECT_LT(rotation_angle(off), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Rotors, FlywheelTest,
                         testing::Values(Flywheel{30, 1, true}, Flywheel{300, 1, true},
                                         Flywheel{1000, 1, true}, Flywheel{30, 0.01, true},
                                         Flywheel{300, 0.01, true}, Flywheel{1000, 0.01, true},
                                         Flywheel{300, 1, false}, Flywheel{1000, 0.01, false}),
                         testing::PrintToStringParamName());

// 1.25 rad a step, where half of that asked for more steps.
TEST(Rotors, TakeNoMoreStepsThanOthers) {
  const WorldDescription world = flywheel_world({300, 1, true}, 1.0 / 60);
  WorldDescription with_usual_steps = world;
  with_usual_steps.settings.adapt = false;
  EXPECT_EQ(spin_course_of(world).frame.coeffs(), spin_course_of(with_usual_steps).frame.coeffs());
}

}  // namespace
}  // namespace tessera
