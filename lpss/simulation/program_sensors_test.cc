// Sensors against what mechanics says they must show.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

Eigen::Vector3d vector_of(const BodyRecord& body, const std::string& name) {
  return {value_of(body, name + "_x"), value_of(body, name + "_y"), value_of(body, name + "_z")};
}

TEST(Imu, FeelsNothingInFreeFallAndTheGroundAtRest) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("imu"));
  Watched world(builder);
  world.step();
  EXPECT_EQ(value_of(world.body("box"), "measures"), 1);
  world.run(0.5);
  EXPECT_NEAR(vector_of(world.body("box"), "acceleration").norm(), 0, 1e-3);
  world.run(3);
  const BodyRecord body = world.body("box");
  EXPECT_NEAR((vector_of(body, "acceleration") - Eigen::Vector3d(0, 0, kG)).norm(), 0, 1e-2);
  EXPECT_NEAR(vector_of(body, "turn").norm(), 0, 1e-3);
}

TEST(Imu, MeasuresAlongItsOwnAxes) {
  const double angle = 20 * EIGEN_PI / 180;
  WorldBuilder builder(settings_of());
  add_slope(builder, angle);
  BodyDescription& box = add_box(builder, "box", {0.5, 0.5, 0.5}, {0, 0, 0}, Motion::kDynamic);
  box.pose.orientation = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY());
  box.pose.position.local = box.pose.orientation * Eigen::Vector3d(0, 0, 0.25);
  box.programs.push_back(example_program("imu"));
  Watched world(builder);
  world.run(2);
  const Eigen::Vector3d felt = vector_of(world.body("box"), "acceleration");
  EXPECT_NEAR(felt.x(), kG * std::sin(angle), 1e-2);
  EXPECT_NEAR(felt.y(), 0, 1e-2);
  EXPECT_NEAR(felt.z(), kG * std::cos(angle), 1e-2);
}

// Away from the axis: w^2 r towards it. The chord of a tick is shorter than its arc by (w dt)^2 / 24.
TEST(Imu, FeelsWhatTurningTakes) {
  constexpr double kRate = 6;  // rad/s
  constexpr double kRadius = 0.5;
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  BodyDescription& disc = builder.add("disc", builder.shape(Cylinder{1, 0.2}), 2, {0.1, 0.2, 1});
  disc.angular_velocity = {0, 0, kRate};
  disc.programs.push_back(example_program("imu", {{"x", kRadius}}));
  Watched world(builder);
  world.run(1);
  const BodyRecord body = world.body("disc");
  const double expected = -kRate * kRate * kRadius;
  EXPECT_NEAR(vector_of(body, "acceleration").x() / expected, 1, 5e-4);
  EXPECT_NEAR(vector_of(body, "acceleration").y(), 0, 5e-3);
  EXPECT_NEAR(vector_of(body, "turn").z(), kRate, 1e-5);
}

TEST(Imu, HasTheNoiseThatItIsGiven) {
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("imu", {{"noise", 0.2}, {"turn_noise", 0.03}}));
  Watched world(builder);
  constexpr int kTicks = 1000;
  double squares = 0;
  double turn_squares = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int tick = 0; tick < kTicks; ++tick) {
    world.step();
    squares += vector_of(world.body("box"), "acceleration").squaredNorm();
    turn_squares += vector_of(world.body("box"), "turn").squaredNorm();
    mean += vector_of(world.body("box"), "acceleration") / kTicks;
  }
  EXPECT_NEAR(std::sqrt(squares / (3 * kTicks)), 0.2, 0.2 * 0.05);
  EXPECT_NEAR(std::sqrt(turn_squares / (3 * kTicks)), 0.03, 0.03 * 0.05);
  EXPECT_NEAR(mean.norm(), 0, 0.03);
}

// A post bears an arm that sticks out by its half: its weight, and the moment of that.
TEST(LoadSensor, ShowsTheWeightAndMomentOfWhatAJointBears) {
  constexpr double kMass = 3;
  WorldBuilder builder(settings_of(2));
  add_box(builder, "arm", {1, 0.1, 0.1}, {0.5, 0.2, 0.2}, Motion::kDynamic, kMass);
  builder.tie("root", JointType::kFixed, "", "arm", {0, 0.2, 0.2});
  add_box(builder, "desk", {0.2, 0.2, 0.2}, {-4.1, 0.2, 0.2}, Motion::kKinematic)
      .programs.push_back(example_program("load", {{"joint", 1}}));
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.run(1);
    const BodyRecord desk = world.body("desk");
    EXPECT_NEAR((vector_of(desk, "force") - Eigen::Vector3d(0, 0, kMass * kG)).norm(), 0, 0.02);
    // The joint lifts the arm's far end, about -y.
    EXPECT_NEAR((vector_of(desk, "torque") - Eigen::Vector3d(0, -kMass * kG * 0.5, 0)).norm(), 0, 0.02);
    world.step({RemoveJoint{JointId{1}}});
    EXPECT_EQ(vector_of(world.body("desk"), "force").norm(), 0);
  }
}

// It falls by g t^2 / 2.
TEST(Altimeter, MeasuresAFallOverSectors) {
  WorldBuilder builder(settings_of(1));
  add_box(builder, "box", {0.2, 0.2, 0.2}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("altimeter"));
  Watched world(builder, 4);
  world.step();
  const double start = value_of(world.body("box"), "height");
  const double speed = value_of(world.body("box"), "climb");
  world.run(1.5);
  EXPECT_NEAR(value_of(world.body("box"), "height") - start, speed * 1.5 - kG * 1.5 * 1.5 / 2, 0.02);
  EXPECT_NEAR(value_of(world.body("box"), "climb") - speed, -kG * 1.5, 1e-3);
  EXPECT_NEAR(value_of(world.body("box"), "height"), world.position("box").z() - 5, 1e-9);
}

TEST(Altimeter, HasTheNoiseThatItIsGiven) {
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("altimeter", {{"noise", 0.5}, {"climb_noise", 0.1}}));
  Watched world(builder);
  constexpr int kTicks = 1000;
  double squares = 0;
  double climb_squares = 0;
  for (int tick = 0; tick < kTicks; ++tick) {
    world.step();
    squares += std::pow(value_of(world.body("box"), "height"), 2);
    climb_squares += std::pow(value_of(world.body("box"), "climb"), 2);
  }
  EXPECT_NEAR(std::sqrt(squares / kTicks), 0.5, 0.5 * 0.1);
  EXPECT_NEAR(std::sqrt(climb_squares / kTicks), 0.1, 0.1 * 0.1);
}

// Five metres in front of a wall, at an angle: 5 m / cos.
TEST(Ranger, MeasuresAlongItsFanOverSectors) {
  WorldBuilder builder(settings_of(4));
  add_box(builder, "wall", {1, 60, 4}, {5.6, 0.2, 0.4}, Motion::kStatic);
  const std::vector<std::pair<absl::string_view, double>> fan = {
      {"x", 0.3}, {"rays", 5}, {"angle", 2.4}, {"heading", 0.2}, {"elevation", 0.1}, {"most", 20}};
  add_box(builder, "box", {0.5, 0.5, 0.5}, {-0.2, 0.2, 0.4}, Motion::kKinematic)
      .programs.push_back(example_program("ranger", {fan.begin(), fan.end()}));
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.step();
    const BodyRecord body = world.body("box");
    for (int ray = 0; ray < 5; ++ray) {
      const double angle = 0.2 - 1.2 + 0.6 * ray;
      const double expected = std::min(5 / (std::cos(angle) * std::cos(0.1)), 20.0);
      EXPECT_NEAR(value_of(body, "range_" + std::to_string(ray)), expected, 1e-4) << ray;
    }
    EXPECT_EQ(value_of(body, "range_4"), 20) << "there it meets nothing near enough";
    EXPECT_EQ(value_of(body, "hits"), 4);
    EXPECT_NEAR(value_of(body, "nearest"), 5 / (std::cos(0.2) * std::cos(0.1)), 1e-4);
    EXPECT_EQ(body.programs.front().values.size(), 2 + 5u) << "no more rays than it has";
  }
}

// Through the box around such a way go some 10^10 sectors, most of them empty.
TEST(Ranger, SeesFarAslantOnAnyPartitions) {
  WorldBuilder builder(settings_of(4));
  add_box(builder, "wall", {1, 60, 60}, {5.6, 0.2, 0.4}, Motion::kStatic);
  for (const double heading : {0.7, 2.4}) {
    add_box(builder, heading < 1 ? "to_the_wall" : "away", {0.5, 0.5, 0.5}, {-0.2, 2 * heading, 0.4},
            Motion::kKinematic)
        .programs.push_back(
            example_program("ranger", {{"heading", heading}, {"elevation", 0.6}, {"most", 1e4}}));
  }
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 3));
}

TEST(Ranger, SeesWhatIsFarEnoughAndOfItsCategories) {
  WorldBuilder builder(settings_of());
  add_box(builder, "near", {0.2, 1, 1}, {1, 0, 1}, Motion::kStatic).properties.category = 2;
  add_box(builder, "far", {0.2, 1, 1}, {3, 0, 1}, Motion::kStatic).properties.category = 4;
  const auto add = [&](const std::string& name, const ProgramNumbers& numbers) {
    add_box(builder, name, {0.1, 0.1, 0.1}, {0, 0, 1}, Motion::kKinematic)
        .programs.push_back(example_program("ranger", numbers));
  };
  add("of_all", {{"mask", 6}});
  add("of_far", {{"mask", 4}});
  add("beyond", {{"mask", 6}, {"least", 2}});
  Watched world(builder);
  world.step();
  EXPECT_NEAR(value_of(world.body("of_all"), "range_0"), 0.9, 1e-5);
  EXPECT_NEAR(value_of(world.body("of_far"), "range_0"), 2.9, 1e-5);
  EXPECT_NEAR(value_of(world.body("beyond"), "range_0"), 2.9, 1e-5);
}

// What lies on a slope is pressed with m g cos, along its own z axis.
TEST(Touch, ShowsTheWeightOnASlope) {
  constexpr double kMass = 3;
  for (const double angle : {0.0, 0.35}) {
    WorldBuilder builder(settings_of(2));
    add_slope(builder, angle);
    BodyDescription& box = add_box(builder, "box", {0.5, 0.5, 0.5}, {0, 0, 0}, Motion::kDynamic, kMass);
    box.pose.orientation = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY());
    box.pose.position.local = box.pose.orientation * Eigen::Vector3d(0, 0, 0.25);
    box.programs.push_back(example_program("touch", {{"threshold", 1}}));
    box.programs.push_back(example_program("touch", {{"threshold", 100}}));
    for (const std::uint32_t partitions : {1u, 4u}) {
      Watched world(builder, partitions);
      world.run(2);
      const BodyRecord body = world.body("box");
      const double expected = kMass * kG * std::cos(angle);
      EXPECT_NEAR(value_of(body, "force"), expected, 0.05);
      EXPECT_NEAR((vector_of(body, "force") - Eigen::Vector3d(0, 0, expected)).norm(), 0, 0.05);
      EXPECT_EQ(value_of(body, "body"), 1) << "the slope";
      EXPECT_EQ(value_of(body, "touches"), 1);
      EXPECT_EQ(value_of(body, "touches", 1), 0);
    }
  }
}

TEST(Touch, FeelsNothingInTheAir) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 50}, Motion::kDynamic)
      .programs.push_back(example_program("touch"));
  Watched world(builder);
  world.run(0.5);
  for (const char* name : {"touches", "body", "force", "force_x", "force_y", "force_z"})
    EXPECT_EQ(value_of(world.body("box"), name), 0) << name;
}

// It flies and turns as it was thrown.
TEST(PoseSensor, ShowsTheWayTheTurnAndTheVelocityFromTheBody) {
  constexpr double kRate = 0.5;  // rad/s
  WorldSettings settings = settings_of(2);
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  BodyDescription& ball = builder.add("ball", builder.shape(Sphere{0.2}), 1, {0.1, 0.2, 1});
  ball.linear_velocity = {3, 0, -1};
  ball.angular_velocity = {0, 0, kRate};
  ball.programs.push_back(example_program("pose"));
  Watched world(builder, 4);
  world.run(2);
  const BodyRecord body = world.body("ball");
  const auto [sin, cos] = std::pair(std::sin(2 * kRate), std::cos(2 * kRate));
  EXPECT_NEAR(value_of(body, "x"), 6, 1e-4);
  EXPECT_NEAR(value_of(body, "y"), 0, 1e-4);
  EXPECT_NEAR(value_of(body, "z"), -2, 1e-4);
  EXPECT_NEAR(value_of(body, "qz"), std::sin(kRate), 1e-4);
  EXPECT_NEAR(value_of(body, "qw"), std::cos(kRate), 1e-4);
  EXPECT_NEAR((vector_of(body, "velocity") - Eigen::Vector3d(3 * cos, -3 * sin, -1)).norm(), 0, 1e-3);
  EXPECT_NEAR((vector_of(body, "rate") - Eigen::Vector3d(0, 0, kRate)).norm(), 0, 1e-5);
}

// d / (M + h) to the north and d / ((N + h) cos) to the east, by the radii of the ellipsoid there; and d^2 /
// 2R up from it, as the plane of the world leaves the earth.
TEST(SatelliteReceiver, CountsDegreesAsTheEarthIsCurved) {
  constexpr double kLatitude = 60;
  constexpr double kHeight = 250;
  constexpr double kEquator = 6378137;
  constexpr double kSquare = 0.00669437999014;
  constexpr double kDegree = EIGEN_PI / 180;
  const double root = std::sqrt(1 - kSquare * std::pow(std::sin(kLatitude * kDegree), 2));
  const double north_radius = kEquator * (1 - kSquare) / std::pow(root, 3) + kHeight;
  const double east_radius = kEquator / root + kHeight;
  for (const bool goes_north : {false, true}) {
    WorldSettings settings = settings_of();
    settings.gravity = UniformGravity{{0, 0, 0}};
    WorldBuilder builder(settings);
    BodyDescription& ball = builder.add("ball", builder.shape(Sphere{0.2}), 1, {0.1, 0.2, 1});
    ball.linear_velocity = {500, 0, 0};
    ball.programs.push_back(example_program("satellite", {{"latitude", kLatitude},
                                                          {"longitude", 179.99},
                                                          {"height", kHeight},
                                                          {"heading", goes_north ? 90 : 0}}));
    Watched world(builder, 4);
    world.step();
    const double first = world.position("ball").x() - 0.1;
    world.run(4);
    const BodyRecord body = world.body("ball");
    const double way = world.position("ball").x() - 0.1;
    EXPECT_NEAR(way, 2000 + first, 0.1);
    const double radius = goes_north ? north_radius : east_radius;
    EXPECT_NEAR(value_of(body, "height"), kHeight + way * way / (2 * radius), 1e-3);
    const double turned = way / radius / kDegree;  // degrees
    if (goes_north) {
      EXPECT_NEAR((value_of(body, "latitude") - kLatitude) / turned, 1, 1e-5);
      EXPECT_NEAR(value_of(body, "longitude"), 179.99, 1e-9);
    } else {
      // Beyond 180 degrees east is the west.
      EXPECT_NEAR((value_of(body, "longitude") + 360 - 179.99) * std::cos(kLatitude * kDegree) / turned, 1,
                  1e-5);
    }
    EXPECT_NEAR(value_of(body, goes_north ? "north" : "east"), 500, 1e-2);
    EXPECT_NEAR(value_of(body, goes_north ? "east" : "north"), 0, 1e-6);
  }
}

TEST(SatelliteReceiver, IsWhereItIsSaidToBeAnywhereOnEarth) {
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  const std::vector<double> latitudes = {-90, -45, -1e-3, 0, 12.5, 52.2, 90};
  for (const double latitude : latitudes) {
    add_box(builder, std::to_string(latitude), {0.1, 0.1, 0.1}, {latitude / 10, 0, 1}, Motion::kKinematic)
        .programs.push_back(
            example_program("satellite", {{"latitude", latitude}, {"longitude", -70.5}, {"height", 9000}}));
  }
  Watched world(builder);
  world.step();
  for (const double latitude : latitudes) {
    const BodyRecord body = world.body(std::to_string(latitude));
    EXPECT_NEAR(value_of(body, "latitude"), latitude, 1e-9);
    if (std::abs(latitude) < 90) {
      EXPECT_NEAR(value_of(body, "longitude"), -70.5, 1e-9);
    }
    EXPECT_NEAR(value_of(body, "height"), 9000, 1e-5);
  }
}

// Mean, deviation, and correlation with what it was a second before, of numbers a tick apart.
struct Statistics {
  double mean = 0;
  double deviation = 0;
  double correlation = 0;
};
Statistics statistics_of(const std::vector<double>& numbers) {
  Statistics result;
  for (const double number : numbers) result.mean += number / static_cast<double>(numbers.size());
  double sum = 0;
  double together = 0;
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    const double off = numbers[n] - result.mean;
    sum += off * off;
    if (n >= 60) together += off * (numbers[n - 60] - result.mean);
  }
  result.deviation = std::sqrt(sum / static_cast<double>(numbers.size()));
  result.correlation = together / sum;
  return result;
}

TEST(Imu, ItsErrorsHaveTheStatisticsThatItIsTold) {
  WorldSettings settings = settings_of(64);
  settings.gravity = UniformGravity{{0, 0, 0}};
  settings.sleep_after = 0;  // never
  WorldBuilder builder(settings);
  const auto add = [&](const std::string& name, double y, const ProgramNumbers& numbers) {
    add_box(builder, name, {1, 1, 1}, {0.1, y, 0}, Motion::kDynamic)
        .programs.push_back(example_program("imu", numbers));
  };
  constexpr int kInstances = 30;
  add("noisy", 0, {{"noise", 0.2}, {"turn_noise", 0.05}, {"offset", 0.5}, {"turn_offset", -0.1}});
  add("wanders", 3, {{"drift", 0.3}, {"drift_time", 2}});
  add("coarse", 6, {{"noise", 0.2}, {"precision", 0.25}});
  for (int n = 0; n < kInstances; ++n) add("biased" + std::to_string(n), 9 + 3 * n, {{"bias", 0.4}});
  Watched world(builder);
  std::vector<double> accelerations;
  std::vector<double> turns;
  std::vector<double> drifts;
  for (int tick = 0; tick < 6000; ++tick) {
    world.cluster().step();
    accelerations.push_back(value_of(world.body("noisy"), "acceleration_x"));
    turns.push_back(value_of(world.body("noisy"), "turn_z"));
    drifts.push_back(value_of(world.body("wanders"), "acceleration_y"));
    const double coarse = value_of(world.body("coarse"), "acceleration_z") / 0.25;
    ASSERT_EQ(coarse, std::round(coarse));
  }
  const Statistics acceleration = statistics_of(accelerations);
  EXPECT_NEAR(acceleration.mean, 0.5, 4 * 0.2 / std::sqrt(6000.0));
  EXPECT_NEAR(acceleration.deviation, 0.2, 0.01);
  EXPECT_NEAR(acceleration.correlation, 0, 0.06);
  EXPECT_NEAR(statistics_of(turns).mean, -0.1, 4 * 0.05 / std::sqrt(6000.0));
  EXPECT_NEAR(statistics_of(turns).deviation, 0.05, 0.003);
  const Statistics drift = statistics_of(drifts);
  EXPECT_NEAR(drift.deviation, 0.3, 0.1) << "100 s are 50 correlation times";
  EXPECT_NEAR(drift.correlation, std::exp(-0.5), 0.15);
  std::vector<double> biases;
  for (int n = 0; n < kInstances; ++n) {
    for (const char* axis : {"acceleration_x", "acceleration_y", "acceleration_z"})
      biases.push_back(value_of(world.body("biased" + std::to_string(n)), axis));
  }
  EXPECT_NEAR(statistics_of(biases).deviation, 0.4, 4 * 0.4 / std::sqrt(2.0 * 3 * kInstances));
  const double before = value_of(world.body("biased0"), "acceleration_x");
  world.run(1);
  EXPECT_EQ(value_of(world.body("biased0"), "acceleration_x"), before) << "it stays";
}

// In front of it at 2 m and, in the next sector, at 4 m; others are beside its view, behind it and too far
// away.
TEST(LogicalCamera, TellsWhatIsInItsFieldOfView) {
  WorldSettings settings = settings_of(25);
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  BodyDescription& eye = add_box(builder, "eye", {14, 14, 14}, {12, 0.2, 0.3}, Motion::kKinematic);
  eye.properties.trigger = true;
  eye.pose.orientation = Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitZ());
  eye.programs.push_back(
      example_program("logical_camera", {{"x", 0.5}, {"near", 0.5}, {"far", 5}, {"angle", 1}}));
  const auto add = [&](const std::string& name, const Eigen::Vector3d& seen) {
    const Eigen::Vector3d turned(-seen.y(), seen.x() + 0.5, seen.z());
    add_box(builder, name, {0.2, 0.2, 0.2}, Eigen::Vector3d(12, 0.2, 0.3) + turned, Motion::kDynamic);
  };
  add("far", {4, -1, 0.5});
  add("near", {2, 0.5, 0});
  add("beside", {2, 1.2, 0});
  add("above", {2, 0, 1});
  add("behind", {-2, 0, 0});
  add("too_far", {5.5, 0, 0});
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.run(0.1);
    const BodyRecord body = world.body("eye");
    EXPECT_EQ(value_of(body, "count"), 2);
    EXPECT_EQ(value_of(body, "body_0"), static_cast<double>(world.body("near").id.value));
    EXPECT_EQ(value_of(body, "body_1"), static_cast<double>(world.body("far").id.value));
    EXPECT_EQ(value_of(body, "body_2"), 0);
    EXPECT_NEAR(value_of(body, "x_1"), 4, 1e-5);
    EXPECT_NEAR(value_of(body, "y_1"), -1, 1e-5);
    EXPECT_NEAR(value_of(body, "z_1"), 0.5, 1e-5);
  }
}

// A value of a sensor, and the parameters of its errors.
struct NoisySensor {
  std::string kind;
  std::string numbers;  // before their names
  std::string value;
  double scale = 1;  // of the errors
};

class LastingErrorsTest : public ::testing::TestWithParam<NoisySensor> {
 protected:
  static WorldSettings settings() {
    WorldSettings settings = settings_of(64);
    settings.gravity = UniformGravity{{0, 0, 0}};
    settings.sleep_after = 0;  // never
    return settings;
  }
  // A body with the sensor, whose parameter is so much.
  void add(const std::string& name, double y, const std::string& number, double much) {
    const auto& [kind, prefix, value, scale] = GetParam();
    add_box(builder_, name, {1, 1, 1}, {0.1, y, 0}, Motion::kDynamic)
        .programs.push_back(
            example_program(kind, {{prefix + number, much * scale}, {prefix + "drift_time", kDriftTime}}));
  }
  static double shown(Watched& world, const std::string& name) {
    return value_of(world.body(name), GetParam().value) / GetParam().scale;
  }

  static constexpr double kDriftTime = 2;  // s
  WorldBuilder builder_{settings()};
};

TEST_P(LastingErrorsTest, OffsetAndBiasStayAndPrecisionIsKept) {
  constexpr int kInstances = 60;
  add("plain", 0, "noise", 0);
  add("off", 2, "offset", 0.5);
  add("coarse", 4, "precision", 0.25);
  for (int n = 0; n < kInstances; ++n) add("biased" + std::to_string(n), 6 + 2 * n, "bias", 0.4);
  Watched world(builder_);
  world.step();
  const double plain = shown(world, "plain");
  EXPECT_NEAR(shown(world, "off") - plain, 0.5, 1e-6);
  EXPECT_NEAR(shown(world, "coarse"), 0.25 * std::round(plain / 0.25), 1e-6);
  std::vector<double> biases;
  for (int n = 0; n < kInstances; ++n) biases.push_back(shown(world, "biased" + std::to_string(n)) - plain);
  EXPECT_NEAR(statistics_of(biases).deviation, 0.4, 4 * 0.4 / std::sqrt(2.0 * kInstances));
  EXPECT_NEAR(statistics_of(biases).mean, 0, 4 * 0.4 / std::sqrt(1.0 * kInstances));
  world.run(1);
  EXPECT_NEAR(shown(world, "biased0") - plain, biases[0], 1e-6);
}

TEST_P(LastingErrorsTest, DriftWandersAsFarAndAsSlowlyAsItIsTold) {
  add("plain", 0, "noise", 0);
  add("wanders", 2, "drift", 0.3);
  Watched world(builder_);
  std::vector<double> drifts;
  for (int tick = 0; tick < 60000; ++tick) {
    world.cluster().step();
    drifts.push_back(shown(world, "wanders") - shown(world, "plain"));
  }
  EXPECT_NEAR(statistics_of(drifts).deviation, 0.3, 0.05) << "1,000 s are 500 drift times";
  EXPECT_NEAR(statistics_of(drifts).correlation, std::exp(-1 / kDriftTime), 0.15) << "after 60 ticks";
}

INSTANTIATE_TEST_SUITE_P(Sensors, LastingErrorsTest,
                         ::testing::Values(NoisySensor{"altimeter", "", "height"},
                                           NoisySensor{"altimeter", "climb_", "climb"},
                                           NoisySensor{"barometer", "", "pressure", 10},
                                           NoisySensor{"magnetometer", "", "field_y", 1e-5},
                                           NoisySensor{"satellite", "height_", "height"},
                                           NoisySensor{"satellite", "velocity_", "north"}),
                         [](const auto& sensor) { return sensor.param.kind + "_" + sensor.param.value; });

}  // namespace
}  // namespace tessera
