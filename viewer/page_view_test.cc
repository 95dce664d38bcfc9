#include "viewer/page_view.h"

#include <gmock/gmock.h>

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
  WorldSettings with_train = settings(128);
  with_train.time_step = 0.5;
  with_train.frames.resize(1);
  with_train.frames[0].velocity = {30, 0, 0};
  BodySample body;
  body.pose.position = {{0, 0, 0, 1}, {1, 2, 3}};
  const PageView outside({{{1, 0, 0}, {0, 0, 0}}, 20}, with_train);
  EXPECT_THAT(outside.see(body, 2, 8).position, ElementsAre(120 + 1 - 128, 2, 3));
  EXPECT_TRUE(outside.see(body, 2, 8).aboard);
  EXPECT_TRUE(outside.holds(outside.see(body, 2, 8)));
  EXPECT_FALSE(outside.holds(outside.see(body, 2, 0)));
  const PageView inside({{{0, 0, 0, 1}, {0, 0, 0}}, 20}, with_train);
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
  const json view = PageView({{{0, -60'000, 0}, {0, 0, 0}}, 20}, earth).describe();
  EXPECT_EQ(view["up"], json({0.0, -1.0, 0.0}));
  EXPECT_EQ(view["planet"]["centre"], json({0.0, 6e6, 0.0}));
  EXPECT_EQ(view["sector"], json({"0", "-60000", "0"}));
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
