// What rides on a kinematic body that is accelerated or turns stays where it is, as long as friction
// suffices.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "lpss/base/rotation.h"
#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kWeight = 9.81;   // m/s^2
constexpr double kFriction = 0.5;  // of all bodies
constexpr double kTickRate = 60;   // 1/s
constexpr double kMost = 0.8 * kFriction * kWeight;
constexpr BodyId kCarrier{1};

using Path = std::function<Pose(double time)>;

enum class Lead { kTargets, kVelocities };

WorldSettings carrier_settings(double sector_size) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{{0, 0, -kWeight}};
  settings.sleep_after = 0;
  return settings;
}

Pose pose_of(PartitionCluster& cluster, BodyId id) {
  const BodyRecord body = *cluster.body(id);
  const double size = cluster.partition(0).sector_size();
  return {metres_between({}, body.home, size) + Eigen::Vector3d(body.state.position.data()),
          quaternion_of(body.state)};
}

// Leads the carrier along a path for a tick, by a target or by the velocities that take it there.
Command led_along(const Path& path, double time, Lead lead, PartitionCluster& cluster) {
  const Pose goal = path(time + 1 / kTickRate);
  if (lead == Lead::kTargets) {
    KinematicTarget target{kCarrier, {}, {}};
    Eigen::Map<Eigen::Vector3d>(target.state.position.data()) = goal.position;
    target.state.rotation = rotation_of(goal.orientation);
    return target;
  }
  const Pose now = pose_of(cluster, kCarrier);
  const Eigen::Vector3d linear = (goal.position - now.position) * kTickRate;
  const Eigen::Vector3d angular = rotation_vector(goal.orientation * now.orientation.conjugate()) * kTickRate;
  return SetVelocity{kCarrier, {linear.x(), linear.y(), linear.z()}, {angular.x(), angular.y(), angular.z()}};
}

// The farthest that any other body has been from its place on the carrier, after a settling time of a second
// in which the carrier stands.
double slip_on(const WorldDescription& world, const Path& path, double seconds, Lead lead) {
  const auto cluster = cluster_of(world, 1);
  for (int tick = 0; tick < 60; ++tick) cluster->step();
  const auto place_of = [&](BodyId id) {
    const Pose carrier = pose_of(*cluster, kCarrier);
    return Eigen::Vector3d(carrier.orientation.conjugate() *
                           (pose_of(*cluster, id).position - carrier.position));
  };
  std::vector<Eigen::Vector3d> places;
  for (std::uint64_t id = 2; id <= world.bodies.size(); ++id) places.push_back(place_of(BodyId{id}));
  double slip = 0;
  for (int tick = 0; tick < seconds * kTickRate; ++tick) {
    const std::vector<Command> commands{led_along(path, tick / kTickRate, lead, *cluster)};
    cluster->step(commands);
    for (std::size_t n = 0; n < places.size(); ++n)
      slip = std::max(slip, (place_of(BodyId{n + 2}) - places[n]).norm());
  }
  return slip;
}

// Boxes at rest on a large plate.
WorldDescription plate_with_boxes(double sector_size) {
  WorldBuilder builder(carrier_settings(sector_size));
  builder.add("plate", builder.shape(Box{{5, 4, 0.2}}), 1, {0, 0, -0.1}, Motion::kKinematic);
  builder.add("flat", builder.shape(Box{{0.4, 0.4, 0.1}}), 2, {0.3, 0, 0.05});
  builder.add("crate", builder.shape(Box{{0.3, 0.5, 0.3}}), 8, {-1, 1, 0.15});
  return builder.world();
}

Path accelerated(const Eigen::Vector3d& acceleration) {
  return [=](double time) {
    return Pose{Eigen::Vector3d(0, 0, -0.1) + acceleration * (time * time / 2),
                Eigen::Quaterniond::Identity()};
  };
}

TEST(Carriers, WhatIsOnAnAcceleratedOneDoesNotSlip) {
  for (const double sector_size : {128.0, 8.0}) {
    for (const Lead lead : {Lead::kTargets, Lead::kVelocities}) {
      for (const double acceleration : {1.0, 2.0, kMost}) {
        EXPECT_LT(slip_on(plate_with_boxes(sector_size), accelerated({acceleration, 0, 0}), 5, lead), 1e-3)
            << acceleration << " m/s^2, sectors of " << sector_size;
      }
    }
  }
}

TEST(Carriers, WhatIsInALiftStays) {
  for (const double acceleration : {-4.0, -1.0, 1.0, 4.0}) {
    EXPECT_LT(slip_on(plate_with_boxes(128), accelerated({0.3, 0, acceleration}), 5, Lead::kTargets), 1e-3)
        << acceleration;
  }
}

TEST(Carriers, WhatIsOnSomethingElseThatRidesSlipsHardlyMore) {
  WorldBuilder builder(carrier_settings(128));
  builder.world() = plate_with_boxes(128);
  builder.add("on_crate", builder.shape(Box{{0.2, 0.2, 0.1}}), 1, {-1, 1, 0.35});
  EXPECT_LT(slip_on(builder.world(), accelerated({2, 0, 0}), 5, Lead::kTargets), 1e-3);
  EXPECT_LT(slip_on(builder.world(), accelerated({kMost, 0, 0}), 5, Lead::kTargets), 1.5e-3);
}

// A deck that rolls and pitches.
TEST(Carriers, WhatIsOnADeckInASwellDoesNotSlip) {
  const Path path = [](double time) {
    const Eigen::Quaterniond roll(Eigen::AngleAxisd(0.2 * std::sin(time), Eigen::Vector3d::UnitY()));
    const Eigen::Quaterniond pitch(Eigen::AngleAxisd(0.1 * std::sin(1.3 * time), Eigen::Vector3d::UnitX()));
    return Pose{{0.2 * (1 - std::cos(time)), 0, -0.1 + 0.3 * std::sin(0.7 * time)}, roll * pitch};
  };
  EXPECT_LT(slip_on(plate_with_boxes(128), path, 10, Lead::kTargets), 1e-3);
}

// To and fro, as a table that shakes.
TEST(Carriers, WhatIsOnAShakenOneDoesNotSlip) {
  constexpr double kPulse = 2 * std::numbers::pi;  // rad/s
  const Path path = [](double time) {
    return Pose{{0.6 * kMost / (kPulse * kPulse) * (1 - std::cos(kPulse * time)), 0, -0.1},
                Eigen::Quaterniond::Identity()};
  };
  EXPECT_LT(slip_on(plate_with_boxes(8), path, 5, Lead::kTargets), 1e-3);
}

// Boxes at several distances from the axis of a disc, over a border where sectors are of 4 m.
WorldDescription disc_with_boxes(double sector_size, std::initializer_list<double> radii) {
  WorldBuilder builder(carrier_settings(sector_size));
  builder.add("disc", builder.shape(Cylinder{1.7, 0.2}), 1, {1.5, 0.5, -0.1}, Motion::kKinematic);
  const ShapeId box = builder.shape(Box{{0.1, 0.1, 0.1}});
  double angle = 0;
  for (const double radius : radii) {
    builder.add(absl::StrCat("box at ", radius), box, 1,
                {1.5 + radius * std::cos(angle), 0.5 + radius * std::sin(angle), 0.05});
    angle += 1;
  }
  return builder.world();
}

// Comes to a rate (rad/s) in a time (s).
Path spun_up(double rate, double duration) {
  return [=](double time) {
    const double angle = time < duration ? rate / duration * time * time / 2 : rate * (time - duration / 2);
    return Pose{{1.5, 0.5, -0.1}, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()))};
  };
}

TEST(Carriers, WhatIsOnATurntableStays) {
  for (const double sector_size : {128.0, 4.0}) {
    for (const Lead lead : {Lead::kTargets, Lead::kVelocities}) {
      // 0.8 mu g at the edge: 0.98 m.
      EXPECT_LT(slip_on(disc_with_boxes(sector_size, {0.3, 0.6, 0.95}), spun_up(2, 3), 8, lead), 1e-3)
          << "sectors of " << sector_size;
    }
  }
  EXPECT_LT(slip_on(disc_with_boxes(128, {0.1, 0.15}), spun_up(5, 3), 8, Lead::kTargets), 1e-3);
}

// Brought to its rate in a tick, under boxes that stand: they slip, and stay where they have come to rest.
TEST(Carriers, WhatHasSlippedOnATurntableStaysWhereItHasCome) {
  const WorldDescription world = disc_with_boxes(128, {0.3, 0.6, 0.95});
  const auto cluster = cluster_of(world, 1);
  const auto place_of = [&](std::uint64_t id) {
    const Pose carrier = pose_of(*cluster, kCarrier);
    return Eigen::Vector3d(carrier.orientation.conjugate() *
                           (pose_of(*cluster, BodyId{id}).position - carrier.position));
  };
  std::vector<Eigen::Vector3d> places;
  const std::vector<Command> turn{SetVelocity{kCarrier, {}, {0, 0, 1.5}}};
  for (int tick = 0; tick < 480; ++tick) {
    cluster->step(tick == 60 ? turn : std::vector<Command>{});
    for (std::uint64_t id = 2; id <= 4; ++id) {
      if (tick == 180) places.push_back(place_of(id));
      if (tick > 180) {
        EXPECT_LT((place_of(id) - places[id - 2]).norm(), 1e-3) << id << ", tick " << tick;
      }
    }
  }
}

// A plank on two rollers that turn fast: it does not sink, and comes to the speed of their surfaces.
TEST(Carriers, RollersDriveWhatLiesOnThem) {
  constexpr double kRate = 40;     // rad/s
  constexpr double kRoller = 0.1;  // m
  WorldBuilder builder(carrier_settings(128));
  const ShapeId roller = builder.shape(Cylinder{kRoller, 1});
  for (const double x : {-1.0, 1.0}) {
    BodyDescription& body =
        builder.add(absl::StrCat("roller at ", x), roller, 1, {x, 0, -kRoller}, Motion::kKinematic);
    body.pose.orientation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX());
    body.angular_velocity = {0, kRate, 0};
  }
  builder.add("plank", builder.shape(Box{{6, 0.4, 0.1}}), 10, {-1, 0, 0.05});
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 30; ++tick) cluster->step();
  const double after_half = cluster->body(BodyId{3})->state.linear_velocity[0];
  EXPECT_NEAR(after_half, kFriction * kWeight * 0.5, 0.1) << "all of friction";
  EXPECT_NEAR(pose_of(*cluster, BodyId{3}).position.z(), 0.05, 1e-3);
}

TEST(Carriers, BitsDependOnNoBorderBetweenServers) {
  const WorldDescription world = disc_with_boxes(4, {0.3, 0.6, 0.95, 1.3, 1.5});
  const Path path = spun_up(2, 1);
  const auto one = cluster_of(world, 1);
  const auto three = cluster_of(world, 3, 2);
  for (int tick = 0; tick < 240; ++tick) {
    const std::vector<Command> commands{led_along(path, tick / kTickRate, Lead::kTargets, *one)};
    one->step(commands);
    three->step(commands);
    ASSERT_EQ(one->hash(), three->hash()) << "tick " << tick;
  }
}

TEST(Carriers, TheVelocityOfOneThatIsLedIsReportedUntilItStops) {
  const auto cluster = cluster_of(plate_with_boxes(128), 1);
  for (int tick = 0; tick < 10; ++tick) {
    const std::vector<Command> commands{
        led_along(accelerated({2, 0, 0}), tick / kTickRate, Lead::kTargets, *cluster)};
    cluster->step(commands);
    // The mean of the tick.
    EXPECT_NEAR(cluster->body(kCarrier)->state.linear_velocity[0], 2 * (tick + 0.5) / kTickRate, 1e-4);
  }
  cluster->step();
  EXPECT_EQ(cluster->body(kCarrier)->state.linear_velocity[0], 0) << "no target: it stays";
  EXPECT_NEAR(pose_of(*cluster, kCarrier).position.x(), 100 / kTickRate / kTickRate, 1e-6);
}

TEST(Carriers, AVelocityLastsUntilACommandChangesIt) {
  const auto cluster = cluster_of(plate_with_boxes(128), 1);
  const std::vector<Command> go{SetVelocity{kCarrier, {0.5, 0, 0}, {}}};
  cluster->step(go);
  for (int tick = 1; tick < 60; ++tick) cluster->step();
  EXPECT_NEAR(pose_of(*cluster, kCarrier).position.x(), 0.5, 1e-5);
  EXPECT_EQ(cluster->body(kCarrier)->state.linear_velocity[0], 0.5);
  KinematicTarget back{kCarrier, {}, {}};
  back.state.position = {0, 0, -0.1};
  const std::vector<Command> both{back, SetVelocity{kCarrier, {0.25, 0, 0}, {}}};
  cluster->step(both);
  EXPECT_NEAR(pose_of(*cluster, kCarrier).position.x(), 0.5 + 0.25 / kTickRate, 1e-5)
      << "the last one counts";
}

}  // namespace
}  // namespace tessera
