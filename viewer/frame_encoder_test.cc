#include "viewer/frame_encoder.h"

#include <gmock/gmock.h>

#include <cstring>

namespace tessera::viewer {
namespace {

SeenBody body(std::uint64_t id, float x = 0) { return {id, {x, 0, 0}, {0, 0, 0, 1}, 0, 0, false}; }

FrameHeader header_of(const std::string& frame) {
  FrameHeader header;
  if (frame.size() >= sizeof header) std::memcpy(&header, frame.data(), sizeof header);
  return header;
}

std::vector<double> ids_of(const std::string& frame) {
  const FrameHeader header = header_of(frame);
  std::vector<double> ids(header.count + header.gone);
  std::memcpy(ids.data(), frame.data() + sizeof header, ids.size() * sizeof(double));
  return ids;
}

TEST(FrameEncoderTest, FirstFrameIsAKeyFrameOfAllBodies) {
  FrameEncoder encoder;
  const std::string frame = encoder.encode(7, {body(1), body(2)});
  const FrameHeader header = header_of(frame);
  EXPECT_EQ(header.flags, kKeyFrame);
  EXPECT_EQ(header.tick, 7u);
  EXPECT_EQ(header.gone, 0u);
  EXPECT_THAT(ids_of(frame), testing::ElementsAre(1, 2));
  EXPECT_EQ(frame.size(), sizeof(FrameHeader) + 2 * (8 + 12 + 16 + 4 + 1 + 1));
}

TEST(FrameEncoderTest, TheLastIdIsExact) {
  const std::string frame = FrameEncoder().encode(1, {body(kBodyIdMax - 1), body(kBodyIdMax)});
  EXPECT_THAT(ids_of(frame), testing::ElementsAre(9007199254740990.0, 9007199254740991.0));
}

TEST(FrameEncoderTest, LaterFramesHaveWhatChangedAndWhatIsGone) {
  FrameEncoder encoder;
  encoder.encode(1, {body(1), body(2), body(3), body(9)});
  const std::string frame = encoder.encode(2, {body(2), body(3, 5), body(4)});
  EXPECT_EQ(header_of(frame).flags, 0u);
  EXPECT_EQ(header_of(frame).count, 2u);
  EXPECT_EQ(header_of(frame).gone, 2u);
  EXPECT_THAT(ids_of(frame), testing::ElementsAre(3, 4, 1, 9));
}

TEST(FrameEncoderTest, NothingIsSentOfAWorldAtRest) {
  FrameEncoder encoder;
  encoder.encode(1, {body(1)});
  EXPECT_EQ(encoder.encode(2, {body(1)}), "");
  encoder.start_over();
  EXPECT_EQ(header_of(encoder.encode(3, {})).flags, kKeyFrame);
  EXPECT_EQ(encoder.encode(4, {}), "");
}

TEST(FrameEncoderTest, ContactsAreThreeArrays) {
  const std::vector<SeenContact> contacts = {{{1, 2, 3}, {0, 0, 1}, 4}, {{5, 6, 7}, {1, 0, 0}, 8}};
  const std::string frame = encode(3, contacts);
  EXPECT_EQ(header_of(frame).kind, FrameKind::kContacts);
  std::array<float, 14> values{};
  ASSERT_EQ(frame.size(), sizeof(FrameHeader) + sizeof values);
  std::memcpy(values.data(), frame.data() + sizeof(FrameHeader), sizeof values);
  EXPECT_THAT(values, testing::ElementsAre(1, 2, 3, 5, 6, 7, 0, 0, 1, 1, 0, 0, 4, 8));
}

}  // namespace
}  // namespace tessera::viewer
