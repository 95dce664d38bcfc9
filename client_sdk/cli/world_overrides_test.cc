#include "client_sdk/cli/world_overrides.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera::cli {
namespace {

WorldDescription world_with_body_at(const SectorIndex& anchor, const WorldPosition& position,
                                    double sector_size) {
  WorldDescription world;
  world.anchor = anchor;
  world.settings.sector_size = sector_size;
  world.bodies.emplace_back();
  world.bodies.back().name = "body";
  world.bodies.back().pose.position = position;
  return world;
}

TEST(ChangeSectorSizeTest, EverythingStaysWhereItIsRelativeToTheAnchor) {
  const SectorIndex anchor{std::int64_t{1} << 62, -5, 7};
  const WorldPosition start{{anchor.i - 50'000, anchor.j + 3, anchor.k}, {60.5, -63.25, 1}};
  WorldDescription world = world_with_body_at(anchor, start, 128);
  world.settings.gravity = CentralGravity{{{anchor.i + 1, anchor.j, anchor.k}, {0, 0, 0}}, 9.81, 6e6};
  ASSERT_TRUE(change_sector_size(world, 50).ok());
  const WorldPosition& moved = world.bodies[0].pose.position;
  EXPECT_EQ(world.settings.sector_size, 50);
  EXPECT_EQ(world.anchor, anchor);
  const Eigen::Vector3d there = metres_between(anchor, moved.sector, 50) + moved.local;
  EXPECT_EQ(there, Eigen::Vector3d(-50'000 * 128.0 + 60.5, 3 * 128 - 63.25, 1));
  EXPECT_LE(moved.local.cwiseAbs().maxCoeff(), 25);
  const WorldPosition& planet = std::get<CentralGravity>(world.settings.gravity).centre;
  EXPECT_EQ((metres_between(anchor, planet.sector, 50) + planet.local).x(), 128);
}

TEST(ChangeSectorSizeTest, JointsToTheWorldStayWhereTheyAre) {
  WorldDescription world = world_with_body_at({}, {{3, 0, 0}, {0, 0, 0}}, 16);
  world.joints.resize(2);
  world.joints[0].properties.anchor = {3, 0, 0};
  world.joints[0].properties.in_parent.position = {2, 0, -1};
  world.joints[1].properties.parent = BodyId{1};
  world.joints[1].properties.in_parent.position = {2, 0, -1};
  ASSERT_TRUE(change_sector_size(world, 100).ok());
  EXPECT_EQ(world.joints[0].properties.anchor, SectorIndex{1});
  EXPECT_EQ(world.joints[0].properties.in_parent.position, Eigen::Vector3d(-50, 0, -1));
  EXPECT_EQ(world.joints[1].properties.in_parent.position, Eigen::Vector3d(2, 0, -1));
}

TEST(ChangeSectorSizeTest, ThereAndBackIsTheSame) {
  const WorldPosition start{{-3, 12, 0}, {1.125, -7.5, 3.0625}};
  WorldDescription world = world_with_body_at({}, start, 16);
  ASSERT_TRUE(change_sector_size(world, 100).ok());
  ASSERT_TRUE(change_sector_size(world, 16).ok());
  EXPECT_EQ(world.bodies[0].pose.position, start);
}

TEST(ChangeSectorSizeTest, RefusesWhatIsTooFarFromTheAnchor) {
  WorldDescription world = world_with_body_at({}, {{std::int64_t{1} << 40, 0, 0}, {0, 0, 0}}, 128);
  const absl::Status status = change_sector_size(world, 64);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("body 'body'"));
}

}  // namespace
}  // namespace tessera::cli
