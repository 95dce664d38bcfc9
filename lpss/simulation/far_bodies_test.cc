// Bodies that pass over many sectors in a tick: what they cost, and whom they meet.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kFarSector = 16;    // m
constexpr double kFarSpeed = 9.9e5;  // m/s: a thousand sectors in a tick

WorldBuilder empty_space() {
  WorldSettings settings = sectors_of(kFarSector);
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  settings.precision = engine_tests::test_precision;
  return WorldBuilder(settings);
}

// The directions are those of a sunflower's seeds.
Eigen::Vector3d direction(int n, int count) {
  const double height = 1 - (2.0 * n + 1) / count;
  const double around = 2.4 * n;
  const double radius = std::sqrt(1 - height * height);
  return {radius * std::cos(around), radius * std::sin(around), height};
}

TEST(FarBodies, TakeNoRoomInSectorsWhereNobodyLives) {
  constexpr int kBodies = 60;
  WorldBuilder builder = empty_space();
  const ShapeId ball = builder.shape(Sphere{0.5});
  for (int n = 0; n < kBodies; ++n) {
    BodyDescription& body =
        builder.add("body" + std::to_string(n), ball, 1, {3.0 * (n % 8), 3.0 * (n / 8), 0});
    body.linear_velocity = kFarSpeed * direction(n, kBodies);
  }
  for (const std::uint32_t partitions : {1u, 2u, 4u}) {
    const auto cluster = cluster_of(builder.world(), partitions);
    for (int tick = 0; tick < 4; ++tick) {
      cluster->step();
      std::size_t sectors = 0;
      for (Rank rank = 0; rank < partitions; ++rank) {
        check_invariants(cluster->partition(rank));
        sectors += cluster->partition(rank).sectors.size();
      }
      EXPECT_LE(sectors, 2u * kBodies) << "in tick " << tick << " on " << partitions << " partitions";
    }
  }
}

TEST(FarBodies, MeetWhoeverLivesOnTheirWay) {
  WorldBuilder builder = empty_space();
  const ShapeId ball = builder.shape(Sphere{0.5});
  const double speed = 40 * kFarSector * 60;  // forty sectors a tick
  builder.add("bullet", ball, 1, {0, 0, 0}).linear_velocity = {speed, 0, 0};
  builder.add("target", ball, 1, {100.5 * kFarSector, 0, 0});
  // In the tick in which the second bullet passes, its target comes to a sector where nobody was: over the
  // border at 40 m.
  constexpr double kMeetTicks = 100.5 / 40;
  builder.add("second_bullet", ball, 1, {0, 40.3, 0}).linear_velocity = {speed, 0, 0};
  builder.add("moving_target", ball, 1, {100.5 * kFarSector, 40.3 - kMeetTicks, 0}).linear_velocity = {0, 60,
                                                                                                       0};
  for (const std::uint32_t partitions : {1u, 2u, 4u}) {
    const auto cluster = cluster_of(builder.world(), partitions);
    for (int tick = 0; tick < 4; ++tick) cluster->step();
    for (const std::uint64_t target : {2, 4}) {
      EXPECT_GT(cluster->body(BodyId{target})->state.linear_velocity[0], 0.1 * speed)
          << target << " on " << partitions << " partitions";
    }
  }
}

}  // namespace
}  // namespace tessera
