// Frames of bodies that a world may have.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "lpss/model/validate.h"

namespace tessera {
namespace {

using testing::HasSubstr;

WorldDescription two_bodies() {
  WorldDescription world;
  world.shapes = {Shape{{{Box{}, Pose{}}}}};
  world.bodies = {BodyDescription{.name = "good::box"}, BodyDescription{.name = "good::floor"}};
  return world;
}

TEST(Frames, AreRefusedWithTheirNameAndTheBound) {
  const auto refusal = [](const FrameDescription& frame) {
    WorldDescription world = two_bodies();
    world.frames = {{"good::frame", 0, {}}, frame};
    return std::string(validate(world).message());
  };
  EXPECT_EQ(refusal({"other", 1, {{1, 2, 3}, {0, 1, 0, 0}}}), "");
  EXPECT_THAT(refusal({"good::frame", 1, {}}), HasSubstr("frame 'good::frame': the name must be unique"));
  EXPECT_THAT(refusal({"good::floor", 1, {}}), HasSubstr("the name must be unique"));
  EXPECT_THAT(refusal({"", 1, {}}), HasSubstr("must not be empty"));
  EXPECT_THAT(refusal({"\xff", 1, {}}), HasSubstr("UTF-8"));
  EXPECT_THAT(refusal({"other", 1000, {}}), HasSubstr("frame 'other': body 1000 must be below"));
  EXPECT_THAT(refusal({"other", 0, {{2e8, 0, 0}, {1, 0, 0, 0}}}), HasSubstr("at most 1e+08 m"));
  EXPECT_THAT(refusal({"other", 0, {{0, 0, 0}, {2, 0, 0, 0}}}), HasSubstr("norm 2"));
}

}  // namespace
}  // namespace tessera
