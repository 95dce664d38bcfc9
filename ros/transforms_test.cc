#include "ros/transforms.h"

#include <gmock/gmock.h>

#include <cmath>

namespace tessera::ros {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kFar = std::int64_t{1} << 62;
constexpr BodyId kBall{1};
constexpr BodyId kBox{2};

BodySample sample(BodyId id, const WorldPosition& position) {
  BodySample body;
  body.id = id;
  body.pose.position = position;
  return body;
}

std::vector<std::string> children(const std::vector<TransformStamped>& transforms) {
  std::vector<std::string> names;
  for (const TransformStamped& transform : transforms) names.emplace_back(transform.child_frame_id);
  return names;
}

class TransformsTest : public ::testing::Test {
 protected:
  TransformsTest() {
    transforms.name(kBall, "ball");
    transforms.name(kBox, "tower::box");
  }

  Transforms transforms{"tessera", {kFar, 0, -kFar}, {.sector_size = 128, .time_step = 0.25}};
};

TEST(RosTimeTest, CountsSecondsAndNanoseconds) {
  const auto time = [](Tick tick, double time_step) {
    const Time at = time_at(tick, time_step);
    return std::pair(at.sec, at.nanosec);
  };
  EXPECT_EQ(time(0, 1.0 / 60), std::pair(0, 0u));
  EXPECT_EQ(time(1, 1.0 / 60), std::pair(0, 16'666'667u));
  EXPECT_EQ(time(60 * 3'600, 1.0 / 60), std::pair(3'600, 0u));
  EXPECT_EQ(time(1, std::nextafter(1.0, 0.0)), std::pair(1, 0u));
  EXPECT_EQ(time(std::uint64_t{1} << 40, 0.1), std::pair(2'147'483'647, 0u));
}

TEST_F(TransformsTest, CountFromTheCentreOfTheSectorAtAnyDistance) {
  BodyFrame frame{3, {sample(kBox, {{kFar + 1, 0, -kFar}, {-63.5, 2, 0.125}})}};
  frame.bodies[0].pose.orientation = {0.5, -0.5, 0.5, -0.5};
  const std::vector<TransformStamped> all = transforms.all(frame);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].header.stamp.sec, 0);
  EXPECT_EQ(all[0].header.stamp.nanosec, 750'000'000u);
  EXPECT_STREQ(all[0].header.frame_id, "tessera");
  EXPECT_STREQ(all[0].child_frame_id, "tower/box");
  const auto& [translation, rotation] = all[0].transform;
  EXPECT_THAT((std::array{translation.x, translation.y, translation.z}), ElementsAre(64.5, 2, 0.125));
  EXPECT_THAT((std::array{rotation.x, rotation.y, rotation.z, rotation.w}),
              ElementsAre(-0.5, 0.5, -0.5, 0.5));
}

TEST_F(TransformsTest, FramesAreChildrenOfTheirBodies) {
  const FoundFrame tool{"tower::tool", kBox, "tower::box", {{1, 2, 3}, {0.5, -0.5, 0.5, -0.5}}};
  const std::vector<TransformStamped> fixed = transforms.fixed({tool}, 3);
  ASSERT_EQ(fixed.size(), 1u);
  EXPECT_STREQ(fixed[0].header.frame_id, "tower/box");
  EXPECT_STREQ(fixed[0].child_frame_id, "tower/tool");
  EXPECT_EQ(fixed[0].header.stamp.nanosec, 750'000'000u);
  const auto& [translation, rotation] = fixed[0].transform;
  EXPECT_THAT((std::array{translation.x, translation.y, translation.z}), ElementsAre(1, 2, 3));
  EXPECT_THAT((std::array{rotation.x, rotation.y, rotation.z, rotation.w}),
              ElementsAre(-0.5, 0.5, -0.5, 0.5));
}

TEST_F(TransformsTest, OnlyWhatIsElsewhereHasChanged) {
  BodyFrame frame{0, {sample(kBall, {}), sample(kBox, {})}};
  EXPECT_THAT(children(transforms.changed(frame)), ElementsAre("ball", "tower/box"));
  EXPECT_THAT(children(transforms.changed(frame)), IsEmpty());
  frame.bodies[0].pose.position.local.z() = 1e-9;
  EXPECT_THAT(children(transforms.changed(frame)), ElementsAre("ball"));
  frame.bodies[1].pose.orientation = {0, 1, 0, 0};
  EXPECT_THAT(children(transforms.changed(frame)), ElementsAre("tower/box"));
  EXPECT_THAT(children(transforms.all(frame)), ElementsAre("ball", "tower/box"));
}

TEST_F(TransformsTest, BodiesThatComeBackAreTold) {
  const BodyFrame frame{0, {sample(kBall, {})}};
  transforms.changed(frame);
  transforms.changed({1, {}});
  EXPECT_THAT(children(transforms.changed(frame)), ElementsAre("ball"));
}

TEST_F(TransformsTest, BodiesAreToldOnceTheyHaveAName) {
  const BodyFrame frame{0, {sample(BodyId{3}, {})}};
  EXPECT_THAT(transforms.changed(frame), IsEmpty());
  transforms.name(BodyId{3}, "late");
  EXPECT_THAT(children(transforms.changed(frame)), ElementsAre("late"));
}

}  // namespace
}  // namespace tessera::ros
