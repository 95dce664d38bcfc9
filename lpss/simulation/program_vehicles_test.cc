// Motorcycles, and trucks with trailers, against what geometry and mechanics say.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

// A box of 200 kg, whose wheels stand where its centre of mass is at about 0.6 m.
BodyDescription& add_motorcycle(WorldBuilder& builder, const Eigen::Vector3d& position,
                                const ProgramNumbers& numbers) {
  BodyDescription& bike = add_box(builder, "bike", {1.6, 0.3, 0.5}, position, Motion::kDynamic, 200);
  bike.programs.push_back(example_program("motorcycle", numbers));
  return bike;
}

// rad, to the left.
double lean_of(const BodyRecord& body) {
  const Eigen::Quaterniond turn = quaternion_of(body.state);
  return std::atan2(-(turn * Eigen::Vector3d::UnitY()).z(), (turn * Eigen::Vector3d::UnitZ()).z());
}

TEST(Motorcycle, StandsAndGoesStraight) {
  WorldBuilder builder(settings_of(64));
  builder.add_floor(400, 0);
  add_motorcycle(builder, {0, 0, 0.6}, {});
  Watched world(builder, 2);
  world.run(5);
  EXPECT_NEAR(world.velocity("bike").norm(), 0, 1e-4);
  EXPECT_NEAR(lean_of(world.body("bike")), 0, 1e-4);
  world.tell("bike", "throttle", 0.4);
  world.run(4);
  EXPECT_NEAR(world.velocity("bike").x(), 4 * 400.0 / 200, 0.15);
  EXPECT_NEAR(world.position("bike").y(), 0, 1e-2);
  EXPECT_EQ(value_of(world.body("bike"), "wheels_on_ground"), 2);
}

TEST(Motorcycle, LeansIntoATurnAsItsSpeedAsks) {
  for (const double way : {1.0, -1.0}) {
    SCOPED_TRACE(way);
    WorldBuilder builder(settings_of(64));
    builder.add_floor(400, 0);
    add_motorcycle(builder, {0, 0, 0.6}, {{"throttle", 1}, {"speed", 9}}).linear_velocity = {8.9, 0, 0};
    Watched world(builder, 2);
    world.run(1);
    world.tell("bike", "steer", 0.15 * way);
    world.run(6);
    const BodyRecord bike = world.body("bike");
    const double speed = world.velocity("bike").head<2>().norm();
    const double rate = bike.state.angular_velocity[2];
    EXPECT_NEAR(speed, 9, 0.3);
    const double angle = value_of(bike, "angle");
    EXPECT_NEAR(angle, 0.15 * 0.6 * way, 1e-9);
    const double lean = std::asin(speed * speed * std::tan(angle) / (kG * 1.4));
    EXPECT_NEAR(lean_of(bike), lean, 0.03 * std::abs(lean));
    EXPECT_NEAR(rate, kG * std::tan(lean) / speed, 0.03 * std::abs(rate));
    EXPECT_NEAR(value_of(bike, "lean"), lean_of(bike), 0.01);
  }
}

TEST(Motorcycle, SteersNoMoreThanItMayLean) {
  WorldBuilder builder(settings_of(64));
  builder.add_floor(400, 0);
  add_motorcycle(builder, {0, 0, 0.6}, {{"throttle", 1}, {"speed", 15}, {"lean", 0.5}, {"steer", 1}})
      .linear_velocity = {14, 0, 0};
  Watched world(builder);
  world.run(8);
  EXPECT_NEAR(lean_of(world.body("bike")), 0.5, 0.03);
}

TEST(Motorcycle, FallsWhereNobodyBalancesIt) {
  WorldBuilder builder(settings_of(64));
  builder.add_floor(400, 0);
  BodyDescription& bike = add_motorcycle(builder, {0, 0, 0.6}, {{"balance", 0}});
  bike.pose.orientation = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX());
  Watched world(builder);
  world.run(5);
  EXPECT_GT(std::abs(lean_of(world.body("bike"))), 1);
}

// On a circle on which the hitch goes with the radius h, the axle of a trailer goes with sqrt(h^2 - d^2),
// where d is the way from one to the other.
TEST(Trailer, CutsTheCornerAsItsLengthSays) {
  constexpr double kBehind = 2;  // m, from the rear axle of the truck to the hitch
  constexpr double kLength = 5;  // m, from there to the middle of the axles of the trailer
  WorldBuilder builder(settings_of(64));
  builder.add_floor(400, 0);
  const ProgramNumbers wheels = {{"wheelbase", 4}, {"track", 2}, {"stiffness", 1.5e5}, {"damping", 2e4}};
  ProgramNumbers driven = wheels;
  for (const auto& number : ProgramNumbers{{"throttle", 1}, {"speed", 3}, {"engine_force", 2e4}})
    driven.push_back(number);
  add_box(builder, "truck", {7, 2.2, 0.8}, {0, 0, 0.7}, Motion::kDynamic, 6000)
      .programs.push_back(example_program("vehicle", driven));
  ProgramNumbers towed = wheels;
  towed.front().second = 0.4;
  add_box(builder, "trailer", {6, 2.2, 0.8}, {-2 - kBehind - kLength, 0, 0.7}, Motion::kDynamic, 4000)
      .programs.push_back(example_program("vehicle", towed));
  builder.tie("hitch", JointType::kBall, "truck", "trailer", {-2 - kBehind, 0, 0.7});
  Watched world(builder, 3);
  world.run(2);
  world.tell("truck", "steer", 0.5);
  world.run(40);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  int ticks = 0;
  double turned = 0;
  while (turned < 2 * EIGEN_PI) {
    world.step();
    turned += world.body("truck").state.angular_velocity[2] * kDt;
    centre += world.position("truck");
    ++ticks;
    ASSERT_LT(ticks, 6000);
  }
  centre /= ticks;
  const auto radius_of = [&](const std::string& body, double along) {
    const Eigen::Vector3d ahead = quaternion_of(world.body(body).state) * Eigen::Vector3d(along, 0, 0);
    return (world.position(body) + ahead - centre).head<2>().norm();
  };
  const double rear = radius_of("truck", -2);
  EXPECT_NEAR(rear, 4 / std::tan(0.3), 0.03 * rear) << "by the angle of the front wheels";
  const double hitch = radius_of("truck", -2 - kBehind);
  EXPECT_NEAR(hitch, std::hypot(rear, kBehind), 0.02 * hitch);
  const double expected = std::sqrt(hitch * hitch - kLength * kLength);
  EXPECT_NEAR(radius_of("trailer", 0), expected, 0.02 * expected);
  EXPECT_NEAR((world.position("truck") - world.position("trailer")).norm(), 9, 0.8);
}

}  // namespace
}  // namespace tessera
