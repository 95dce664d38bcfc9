#include "worlds/knobs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/settings_json.h"

namespace tessera {
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

TEST(KnobsTest, JsonAndBackIsTheSame) {
  Knobs knobs;
  knobs.set(&WorldSettings::precision, Precision::kFloat64);
  knobs.set(&WorldSettings::seams, SeamPolicy::kClone);
  knobs.set(&WorldSettings::time_step, 1.0 / 3);
  knobs.set(&WorldSettings::shuffle, ~std::uint64_t{0});
  knobs.set(&WorldSettings::friction_in_two_directions, false);
  knobs.set(&WorldSettings::substeps, 4);
  knobs.set(&WorldSettings::adapt, false);
  const nlohmann::ordered_json json = to_json(knobs);
  EXPECT_EQ(json.size(), 7u);
  const absl::StatusOr<Knobs> back = knobs_from_json(nlohmann::ordered_json::parse(json.dump()));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->get(&WorldSettings::precision), Precision::kFloat64);
  EXPECT_EQ(back->get(&WorldSettings::time_step), 1.0 / 3);
  EXPECT_EQ(to_json(*back), json);
}

TEST(KnobsTest, EverySettingIsWrittenAndRead) {
  const nlohmann::ordered_json json = to_json(WorldSettings());
  const absl::StatusOr<Knobs> knobs = knobs_from_json(json);
  ASSERT_TRUE(knobs.ok()) << knobs.status();
  EXPECT_EQ(to_json(*knobs), json);
  EXPECT_EQ(json.size(), kSettings.size());
}

TEST(KnobsTest, OnlyWhatIsSetChanges) {
  WorldDescription world;
  const absl::StatusOr<Knobs> knobs = knobs_from_json({{"solver_iterations", 30}, {"sector_size", 64.0}});
  ASSERT_TRUE(knobs.ok()) << knobs.status();
  ASSERT_TRUE(apply(*knobs, world).ok());
  EXPECT_EQ(world.settings.solver_iterations, 30);
  EXPECT_EQ(world.settings.sector_size, 64);
  EXPECT_EQ(world.settings.time_step, WorldSettings().time_step);
}

TEST(KnobsTest, RefusesWhatIsNoSettingAndNamesIt) {
  const auto message = [](const nlohmann::ordered_json& json) {
    return std::string(knobs_from_json(json).status().message());
  };
  EXPECT_THAT(message({{"gravity", 9.81}}), ::testing::HasSubstr("no setting \"gravity\""));
  EXPECT_THAT(message({{"substeps", -1}}), ::testing::HasSubstr("\"substeps\" cannot be -1"));
  EXPECT_THAT(message({{"substeps", 1ull << 40}}), ::testing::HasSubstr("\"substeps\" cannot be"));
  EXPECT_THAT(message({{"precision", "f16"}}), ::testing::HasSubstr("\"precision\" cannot be"));
  EXPECT_THAT(message({{"island_cap", 100}}), ::testing::HasSubstr("no setting \"island_cap\""));
  EXPECT_FALSE(knobs_from_json(nlohmann::ordered_json::array()).ok());
}

TEST(KnobsTest, TextIsReadUpToItsBoundHoweverDeepItIsNested) {
  EXPECT_TRUE(knobs_from_text(R"({"substeps": 8})").ok());
  const auto message = [](const std::string& text) {
    return std::string(knobs_from_text(text).status().message());
  };
  EXPECT_THAT(message("substeps = 8"), ::testing::HasSubstr("not JSON"));
  const std::size_t depth = kSettingsFileBytesMax / 2 - 10;
  EXPECT_THAT(message(R"({"substeps": )" + std::string(depth, '[') + std::string(depth, ']') + "}"),
              ::testing::HasSubstr("\"substeps\" cannot be an array"));
  EXPECT_THAT(message(std::string(kSettingsFileBytesMax + 1, ' ')),
              ::testing::HasSubstr("at most 65536 bytes"));
}

}  // namespace
}  // namespace tessera
