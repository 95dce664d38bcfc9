#include "viewer/page_view.h"

#include <gmock/gmock.h>

#include <numbers>

#include "viewer/json.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::FloatNear;

constexpr std::int64_t kFar = std::int64_t{1} << 62;

WorldSettings settings(double sector_size) {
  WorldSettings settings;
  settings.sector_size = sector_size;
  return settings;
}

// A frame at 30 m/s, in ticks of half a second.
WorldSettings with_train() {
  WorldSettings train = settings(128);
  train.time_step = 0.5;
  train.frames.resize(1);
  train.frames[0].velocity = {30, 0, 0};
  return train;
}

TEST(PageViewTest, BodiesAreSeenFromTheSectorOfTheCameraAtAnyDistance) {
  BodySample body;
  body.id = BodyId{7};
  body.linear_velocity = {3, 0, 4};
  for (const std::int64_t far : {std::int64_t{0}, kFar, -kFar}) {
    body.pose.position = {{far + 1, 0, far}, {-63.999, 2, 0.125}};
    const PageView view({{{far, 0, far}, {10, 10, 0}}, 100}, settings(128));
    const SeenBody seen = view.see(body, 2, 0);
    EXPECT_THAT(seen.position, ElementsAre(FloatNear(64.001F, 1e-5F), 2, 0.125F));
    EXPECT_EQ(seen.speed, 5);
    EXPECT_EQ(seen.server, 2);
  }
}

TEST(PageViewTest, BodiesOfOtherFramesAreWhereTheseAre) {
  const WorldSettings train = with_train();
  BodySample body;
  body.pose.position = {{0, 0, 0, 1}, {1, 2, 3}};
  const PageView outside({{{1, 0, 0}, {0, 0, 0}}, 20}, train);
  EXPECT_THAT(outside.see(body, 2, 8).position, ElementsAre(120 + 1 - 128, 2, 3));
  EXPECT_TRUE(outside.see(body, 2, 8).aboard);
  EXPECT_TRUE(outside.holds(outside.see(body, 2, 8)));
  EXPECT_FALSE(outside.holds(outside.see(body, 2, 0)));
  const PageView inside({{{0, 0, 0, 1}, {0, 0, 0}}, 20}, train);
  EXPECT_THAT(inside.see(body, 2, 8).position, ElementsAre(1, 2, 3));
  EXPECT_FALSE(inside.see(body, 2, 8).aboard);
  body.pose.position = {{0, 0, 0}, {1, 2, 3}};
  EXPECT_THAT(inside.see(body, 2, 8).position, ElementsAre(1 - 120, 2, 3));
}

TEST(PageViewTest, ContactsOutsideOfTheViewAreLeftOut) {
  const PageView view({{{kFar, 0, 0}, {0, 0, 0}}, 20}, settings(128));
  ContactFrame frame;
  frame.contacts.resize(3);
  frame.contacts[0].position = {{kFar, 0, 0}, {1, 2, 3}};
  frame.contacts[1].position = {{0, 0, 0}, {1, 2, 3}};
  frame.contacts[2] = frame.contacts[0];
  frame.contacts[2].phase = ContactPhase::kEnd;
  EXPECT_EQ(view.see(frame).size(), 1u);
}

TEST(PageViewTest, UpIsAwayFromThePlanet) {
  WorldSettings earth = settings(100);
  earth.gravity = CentralGravity{{{0, 0, 0}, {0, 0, 0}}, 9.8, 6e6};
  const json view = PageView({{{0, -60'000, 0}, {0, 0, 0}}, 20}, earth).describe(0);
  EXPECT_EQ(view["up"], json({0.0, -1.0, 0.0}));
  EXPECT_EQ(view["planet"]["centre"], json({0.0, 6e6, 0.0}));
  EXPECT_EQ(view["sector"], json({"0", "-60000", "0"}));
}

TEST(PageViewTest, UpIsAgainstWhatAFrameThatTurnsMakesOfGravity) {
  WorldSettings habitat = settings(128);
  habitat.gravity = UniformGravity{{0, 0, 0}};
  habitat.frames.resize(1);
  habitat.frames[0].name = "ring";
  habitat.frames[0].spin = {0.5, 0, 0};
  const PageView floor({{{0, 0, 0, 1}, {0, 0, -40}}, 20}, habitat);
  EXPECT_TRUE(floor.up(8).isApprox(Eigen::Vector3d(0, 0, 1)));
  const PageView wall({{{0, 0, 0, 1}, {0, 40, 0}}, 20}, habitat);
  EXPECT_TRUE(wall.up(8).isApprox(Eigen::Vector3d(0, -1, 0)));
  const PageView axis({{{0, 0, 0, 1}, {0, 0, 0}}, 20}, habitat);
  EXPECT_TRUE(axis.up(8).isApprox(Eigen::Vector3d(0, 0, 1))) << "nothing is felt";
  const json view = floor.describe(8);
  EXPECT_EQ(view["frame"], 1);
  EXPECT_EQ(view["frame_name"], "ring");
  EXPECT_FALSE(view.contains("planet"));
}

TEST(PageViewTest, UpStaysWhereATrainBrakesAndIsFeltThroughFramesAround) {
  WorldSettings planet = settings(128);
  planet.gravity = UniformGravity{{0, 0, -10}};
  planet.frames.resize(2);
  planet.frames[0].start.orientation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX());
  planet.frames[1].start.position.sector.frame = 1;
  planet.frames[1].legs = {{.seconds = 100, .acceleration = {8, 0, 0}}};
  const PageView train({{{0, 0, 0, 2}, {0, 0, 0}}, 20}, planet);
  EXPECT_TRUE(train.up(8).isApprox(Eigen::Vector3d(0, 1, 0)));
  planet.frames[0].falls = true;
  const PageView falling({{{0, 0, 0, 2}, {0, 0, 0}}, 20}, planet);
  EXPECT_TRUE(falling.up(8).isApprox(Eigen::Vector3d(0, 0, 1))) << "nothing is felt";
}

TEST(PageViewTest, UpIsAgainstGravityInAFrameWithACarrier) {
  WorldSettings ship = settings(128);
  ship.frames.resize(1);
  ship.frames[0].carrier = FrameCarrier{.body = BodyId{3}};
  BodySample carrier;
  carrier.id = BodyId{3};
  carrier.pose.orientation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX());
  PageView seen({{{0, 0, 0, 1}, {0, 0, 0}}, 20}, ship);
  EXPECT_TRUE(seen.up(8).isApprox(Eigen::Vector3d(0, 0, 1))) << "nobody has seen the ship";
  BodyFrame frame;
  frame.bodies = {carrier};
  seen.see_carriers(frame);
  EXPECT_TRUE(seen.up(8).isApprox(Eigen::Vector3d(0, 1, 0)));
  PageView next({{{1, 0, 0, 1}, {0, 0, 0}}, 20}, ship);
  next.go_on_from(seen);
  EXPECT_TRUE(next.up(8).isApprox(Eigen::Vector3d(0, 1, 0)));
}

TEST(PageViewTest, APlanetIsWhereItIsFromAFrameInOrbit) {
  WorldSettings earth = settings(100);
  earth.time_step = 0.5;
  earth.gravity = CentralGravity{{{0, 0, 0}, {0, 0, 0}}, 9.8, 6e6};
  earth.frames.resize(1);
  earth.frames[0].start.position = {{0, 0, 70'000}, {0, 0, 0}};
  earth.frames[0].velocity = {1000, 0, 0};
  const PageView station({{{0, 0, 0, 1}, {0, 0, 0}}, 20}, earth);
  EXPECT_TRUE(station.planet(8)->isApprox(Eigen::Vector3d(-4000, 0, -7e6)));
}

TEST(PageViewTest, AViewInAFrameThatTheWorldLacksIsInTheWorldFrame) {
  const Interest interest{{{5, 0, 0, 2}, {1, 0, 0}}, 20};
  WorldSettings train = settings(128);
  train.frames.resize(1);
  EXPECT_EQ(known_in(train, interest).centre.sector, (SectorIndex{5, 0, 0}));
  train.frames.resize(2);
  EXPECT_EQ(known_in(train, interest), interest);
}

TEST(PageViewTest, ContactsOfOtherFramesAreWhereTheseAre) {
  const WorldSettings train = with_train();
  ContactFrame frame;
  frame.tick = 8;
  frame.contacts.resize(1);
  frame.contacts[0].position = {{0, 0, 0, 1}, {1, 2, 3}};
  frame.contacts[0].normal = {0, 0, 1};
  const std::vector<SeenContact> seen = PageView({{{1, 0, 0}, {0, 0, 0}}, 20}, train).see(frame);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_THAT(seen[0].position, ElementsAre(120 + 1 - 128, 2, 3));
  EXPECT_THAT(seen[0].normal, ElementsAre(0, 0, 1));
}

TEST(JsonTest, FramesOfPositionsAreKept) {
  const WorldPosition position{{3, 4, 5, 7}, {0.1, -2.5, 1e-9}};
  EXPECT_EQ(position_from(to_json(position)).value(), position);
  EXPECT_FALSE(to_json(WorldPosition{}).contains("frame"));
  json given = to_json(position);
  given["frame"] = -1;
  EXPECT_EQ(position_from(given).status().message(), "frame: expected a whole number from 0 to 2^64 - 1");
  given["frame"] = 257;
  EXPECT_EQ(position_from(given).status().message(), "frame: 257 is not 0 to 256");
}

TEST(JsonTest, SectorIndicesKeepAllTheirBits) {
  const WorldPosition position{{kFar + 1, -kFar - 3, INT64_MAX}, {0.1, -2.5, 1e-9}};
  EXPECT_EQ(position_from(json::parse(dump(to_json(position)))).value(), position);
}

TEST(JsonTest, TriggersAreToldAsSuch) {
  FoundBody found;
  EXPECT_EQ(to_json(found)["trigger"], false);
  found.properties.trigger = true;
  EXPECT_EQ(to_json(found)["trigger"], true);
  const PartMaterial trigger{.trigger = true};
  const ShapePart solid{Sphere{1}, {}, {}};
  const ShapePart clear{Sphere{2}, {}, trigger};
  EXPECT_EQ(to_json(Shape{{clear}})[0]["trigger"], true);
  const json parts = to_json(Shape{{solid, clear}});
  ASSERT_EQ(parts.size(), 1u) << "it would hide the others";
  EXPECT_FALSE(parts[0].contains("trigger"));
}

TEST(JsonTest, PositionsThatAreNoneAreRefused) {
  for (const char* text :
       {R"({})", R"({"sector": [1, 2, 3], "local": [0, 0, 0]})",
        R"({"sector": ["1", "2", "9223372036854775808"], "local": [0, 0, 0]})",
        R"({"sector": ["1", "2", "3"], "local": [0, 0]})", R"({"sector": ["1", "2", "3"]})",
        R"({"sector": ["1", "2", "3"], "local": [0, 0, "0"]})"}) {
    EXPECT_FALSE(position_from(json::parse(text)).ok()) << text;
  }
}

TEST(JsonTest, NumbersThatAreNotNaturalAreRefused) {
  EXPECT_EQ(natural_from(json::parse("18446744073709551615")).value(), UINT64_MAX);
  EXPECT_EQ(natural_from(json(0)).value(), 0);
  for (const char* text : {"18446744073709551685", "-1", "1.5", "1e3", R"("1")", "null"})
    EXPECT_FALSE(natural_from(json::parse(text)).ok()) << text;
}

TEST(JsonTest, MessagesOfPagesAreShallow) {
  EXPECT_EQ(message_from(R"({"type": "ask", "at": {"local": [1, 2]}})")["at"]["local"][1], 2);
  EXPECT_TRUE(message_from("{").is_discarded());
  EXPECT_TRUE(message_from(std::string(4096, '[')).is_discarded());
  const std::string deep = std::string(4096, '[') + std::string(4096, ']');
  EXPECT_TRUE(message_from(R"({"type": "ask", "id": )" + deep + "}").is_discarded());
}

}  // namespace
}  // namespace tessera::viewer
