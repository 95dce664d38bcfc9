// Thrusters and wings against what mechanics says.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

constexpr double kHalfPi = EIGEN_PI / 2;

WorldSettings weightless() {
  WorldSettings settings = settings_of(64);
  settings.gravity = UniformGravity{{0, 0, 0}};
  return settings;
}

TEST(Thruster, SpeedsUpAsItsForceSays) {
  WorldBuilder builder(weightless());
  add_box(builder, "probe", {1, 1, 1}, {0.1, 0.2, 5}, Motion::kDynamic, 4)
      .programs.push_back(example_program("thruster", {{"force", 10}}));
  Watched world(builder);
  world.run(1);
  EXPECT_EQ(world.velocity("probe").norm(), 0);
  world.tell("probe", "throttle", 0.8);
  world.run(2);
  EXPECT_NEAR(world.velocity("probe").x(), 2 * 8.0 / 4, 1e-4);
  world.tell("probe", "throttle", -0.8);
  world.run(2);
  EXPECT_NEAR(world.velocity("probe").norm(), 8.0 / 4 * kDt, 1e-4) << "it is told a tick before it acts";
}

// With a lag T, the force comes as 1 - exp(-t / T): F / m (t - T (1 - exp(-t / T))).
TEST(Thruster, FollowsItsInputWithItsLag) {
  constexpr double kLag = 0.5;
  WorldBuilder builder(weightless());
  add_box(builder, "probe", {1, 1, 1}, {0.1, 0.2, 5}, Motion::kDynamic, 4)
      .programs.push_back(
          example_program("thruster", {{"force", 10}, {"lag", kLag}, {"rise", kHalfPi}, {"throttle", 1}}));
  Watched world(builder);
  world.run(2);
  const double expected = 10.0 / 4 * (2 - kLag * (1 - std::exp(-2 / kLag)));
  EXPECT_NEAR(world.velocity("probe").z(), expected, 10.0 / 4 * kDt);
  EXPECT_NEAR(value_of(world.body("probe"), "throttle"), 1 - std::exp(-2 / kLag), 1e-9);
}

// A force beside the centre of mass, and its reaction, turn the body: F r / I, and F k / I.
TEST(Thruster, TurnsItsBody) {
  WorldBuilder builder(weightless());
  BodyDescription& probe = add_box(builder, "probe", {1, 1, 1}, {0.1, 0.2, 5}, Motion::kDynamic, 6);
  probe.programs.push_back(example_program("thruster", {{"force", 1}, {"y", -0.3}, {"throttle", 1}}));
  probe.programs.push_back(
      example_program("thruster", {{"force", 2}, {"rise", kHalfPi}, {"reaction", 0.2}, {"throttle", 1}}));
  Watched world(builder);
  constexpr double kSeconds = 0.2;
  world.run(kSeconds);
  const double inertia = 6.0 * 2 / 12;  // of a cube of 1 m
  const double time = kSeconds - kDt;   // it acts from the second tick on
  EXPECT_NEAR(world.body("probe").state.angular_velocity[2], (0.3 + 2 * 0.2) / inertia * time, 1e-4);
}

// Four rotors bear a frame, and their reactions cancel.
TEST(Thruster, FourBearAFrame) {
  WorldBuilder builder(settings_of(64));
  BodyDescription& frame = add_box(builder, "frame", {0.5, 0.5, 0.1}, {0.1, 0.2, 5}, Motion::kDynamic, 2);
  const double share = 2 * kG / 4;
  int n = 0;
  for (const double x : {-0.2, 0.2}) {
    for (const double y : {-0.2, 0.2}) {
      const double reaction = ++n == 1 || n == 4 ? 0.02 : -0.02;
      frame.programs.push_back(example_program("thruster", {{"x", x},
                                                            {"y", y},
                                                            {"rise", kHalfPi},
                                                            {"force", 4 * share},
                                                            {"reaction", reaction},
                                                            {"throttle", 0.25}}));
    }
  }
  Watched world(builder);
  world.run(2);
  EXPECT_NEAR(world.velocity("frame").z(), -kG * kDt, 1e-3) << "it falls for a tick before they push";
  EXPECT_NEAR(Eigen::Vector3d(world.body("frame").state.angular_velocity.data()).norm(), 0, 1e-5);
}

// So heavy to turn that it flies as it is turned.
BodyDescription& add_glider(WorldBuilder& builder, const Eigen::Vector3d& velocity,
                            const ProgramNumbers& numbers) {
  BodyDescription& glider = add_box(builder, "glider", {1, 4, 0.1}, {0.1, 0.2, 5}, Motion::kDynamic, 5);
  glider.properties.inertia = {1e9, 1e9, 1e9};
  glider.linear_velocity = velocity;
  glider.programs.push_back(example_program("wing", numbers));
  return glider;
}

// What falls flat comes to the speed at which its drag bears it: m g = rho / 2 v^2 A (c + 2).
TEST(Wing, FallsFlatAsAPlate) {
  WorldBuilder builder(settings_of(64));
  add_glider(builder, {0, 0, 0}, {{"area", 2}, {"drag", 0.1}});
  Watched world(builder);
  world.run(10);
  EXPECT_NEAR(world.velocity("glider").z(), -std::sqrt(2 * 5 * kG / (1.2 * 2 * 2.1)), 0.02);
  EXPECT_NEAR(value_of(world.body("glider"), "angle"), kHalfPi, 1e-3);
}

// A level wing glides at the angle whose tangent is drag by lift, as fast as both bear it.
TEST(Wing, GlidesAtTheAngleOfItsLiftAndDrag) {
  constexpr double kArea = 4;
  WorldBuilder builder(settings_of(64));
  add_glider(builder, {8, 0, -0.5}, {{"area", kArea}});
  Watched world(builder);
  world.run(40);
  const auto drag_of = [](double angle) { return 0.02 + 0.06 * 6.28 * 6.28 * angle * angle; };
  double low = 1e-4;
  double high = 0.26;
  for (int n = 0; n < 60; ++n) {
    const double angle = (low + high) / 2;
    (std::tan(angle) * 6.28 * angle < drag_of(angle) ? low : high) = angle;
  }
  const double pressed = std::hypot(6.28 * low, drag_of(low));
  const Eigen::Vector3d velocity = world.velocity("glider");
  EXPECT_NEAR(-velocity.z() / velocity.x(), std::tan(low), 0.02 * std::tan(low));
  EXPECT_NEAR(velocity.norm(), std::sqrt(2 * 5 * kG / (1.2 * kArea * pressed)), 0.05);
}

// Lift does no work, and wind carries along.
TEST(Wing, LiftDoesNoWorkAndWindCarries) {
  WorldBuilder builder(weightless());
  add_glider(builder, {20, 0, 0}, {{"drag", 0}, {"induced", 0}, {"zero_lift", -0.02}, {"area", 0.2}});
  Watched world(builder);
  world.run(2);
  EXPECT_GT(world.velocity("glider").z(), 0.1);
  EXPECT_NEAR(world.velocity("glider").norm(), 20, 0.02);

  WorldBuilder windy(weightless());
  add_glider(windy, {0, 0, 0}, {{"wind_z", 6}, {"area", 10}});
  Watched carried(windy);
  carried.run(20);
  EXPECT_NEAR(carried.velocity("glider").z(), 6, 0.3);
}

}  // namespace
}  // namespace tessera
