// Frames of bodies, and frames that move, that a world may have.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "lpss/model/frame_keys.h"
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

TEST(MovingFrames, AreRefusedWithTheirNameAndTheBound) {
  const auto refusal = [](const std::function<void(MovingFrame&)>& change) {
    WorldDescription world = two_bodies();
    world.settings.frames.resize(2);
    world.settings.frames[0].name = "train";
    MovingFrame& frame = world.settings.frames[1];
    frame.name = "ship";
    frame.velocity = {3e7, 0, 0};
    frame.legs = {{2, {0, 0, 1}}};
    world.bodies[0].pose.position.sector.frame = 2;
    change(frame);
    return std::string(validate(world).message());
  };
  EXPECT_EQ(refusal([](MovingFrame&) {}), "");
  EXPECT_THAT(refusal([](MovingFrame& f) { f.name = "train"; }),
              HasSubstr("settings: frame 'train': another frame has this name"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.name = ""; }), HasSubstr("its name must not be empty"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.velocity.x() = 4e8; }),
              HasSubstr("frame 'ship': velocity = 4e+08 m/s must be at most 3e+08 m/s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.spin.z() = NAN; }), HasSubstr("spin"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.start.orientation.w() = 2; }), HasSubstr("norm"));
  EXPECT_EQ(refusal([](MovingFrame& f) { f.start.position.sector.frame = 1; }), "");
  EXPECT_THAT(refusal([](MovingFrame& f) { f.start.position.sector.frame = 2; }),
              HasSubstr("it must start in the world frame, or in a frame that is listed before it"));
  EXPECT_THAT(refusal([](MovingFrame& f) {
                f.start.position.sector.frame = 1;
                f.legs.clear();
                f.falls = true;
              }),
              HasSubstr("it falls, and must start in the world frame"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.legs[0].seconds = 0; }), HasSubstr("leg 1: seconds = 0"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.legs[0].acceleration.x() = 1e9; }),
              HasSubstr("leg 1: acceleration"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.legs.resize(kFrameLegsMax + 1, f.legs[0]); }),
              HasSubstr("legs must be at most 4096"));
}

TEST(MovingFrames, KeysAreRefusedWithTheirNumberAndTheBound) {
  const auto refusal = [](const std::function<void(MovingFrame&)>& change, bool is_smoothed = true) {
    WorldSettings settings;
    settings.frames.resize(1);
    MovingFrame& frame = settings.frames[0];
    frame.name = "tram";
    frame.keys = {{0, {}, {}, {}}, {2, {{3, 4, 0}, {0, 0, 0, 1}}, {}, {}}, {5, {}, {}, {}}};
    frame.loops = true;
    change(frame);
    if (is_smoothed) smooth_keys(frame.keys, frame.loops);
    return std::string(validate(settings).message());
  };
  EXPECT_EQ(refusal([](MovingFrame&) {}), "");
  EXPECT_THAT(refusal([](MovingFrame&) {}, false),
              HasSubstr("frame 'tram': key 1: its velocity and its spin are to be found by smooth_keys()"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.spin.z() = 1; }), HasSubstr("it has keys, and so no velocity"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.legs = {{1, {0, 0, 0}}}; }), HasSubstr("it has keys"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.falls = true; }), HasSubstr("it has keys"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys.clear(); }), HasSubstr("it loops, and must have keys"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys.resize(1); }), HasSubstr("its 1 keys must be at least 2"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys.resize(kFrameKeysMax + 1); }),
              HasSubstr("its 4097 keys must be at least 2 and at most 4096"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[0].time = 1; }),
              HasSubstr("key 1: time = 1 s must be 0 s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[2].time = 2; }),
              HasSubstr("key 3: time = 2 s must be at least 1e-05 s after that of the key before, 2 s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[1].time = NAN; }), HasSubstr("key 2: time = nan"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[2].time = 2e9; }), HasSubstr("at most 1e+09 s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[1].pose.position.x() = 2e12; }),
              HasSubstr("key 2: position = 2e+12 m must be at most 1e+12 m"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[1].pose.position.x() = 1e9; }),
              HasSubstr("key 2: speed from the key before = 5e+08 m/s must be at most 3e+08 m/s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[1].velocity = Eigen::Vector3d(4e8, 0, 0); }),
              HasSubstr("key 2: velocity = 4e+08 m/s must be at most 3e+08 m/s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[1].spin = Eigen::Vector3d(0, 0, 1001); }),
              HasSubstr("key 2: spin = 1001 rad/s must be at most 1000 rad/s"));
  EXPECT_THAT(refusal([](MovingFrame& f) { f.keys[2].pose.position.y() = 0.5; }),
              HasSubstr("its last key is 0.5 m and 0 rad from its first, which must be at most 1e-06"));
  EXPECT_THAT(refusal([](MovingFrame& f) {
                f.keys[0].velocity = Eigen::Vector3d(1, 0, 0);
                f.keys[2].velocity = Eigen::Vector3d(2, 0, 0);
              }),
              HasSubstr("its last key must have the velocity and the spin of its first"));
}

TEST(MovingFrames, FallOnOrbitsThatComeBack) {
  WorldSettings settings;
  settings.gravity = CentralGravity{{}, 9.81, 6.4e6};
  settings.frames.resize(1);
  MovingFrame& frame = settings.frames[0];
  frame.name = "station";
  frame.falls = true;
  frame.start.position = *canonical({}, {6.8e6, 0, 0}, settings.sector_size);
  const auto refusal = [&](const Eigen::Vector3d& velocity) {
    frame.velocity = velocity;
    return std::string(validate(settings).message());
  };
  EXPECT_EQ(refusal({0, 7.7e3, 0}), "");
  EXPECT_THAT(refusal({0, 7e3, 0}),
              HasSubstr("frame 'station': velocity: it falls on an orbit that comes down to"));
  EXPECT_THAT(refusal({0, 12e3, 0}), HasSubstr("it escapes from the planet"));
  frame.legs = {{1, {0, 0, 0}}};
  EXPECT_THAT(refusal({0, 7.7e3, 0}), HasSubstr("it falls, and so has no legs"));
}

TEST(MovingFrames, BodiesAndJointsBelongToThem) {
  WorldDescription world = two_bodies();
  world.settings.frames.resize(1);
  world.settings.frames[0].name = "ship";
  world.bodies[0].pose.position.sector.frame = 2;
  EXPECT_THAT(std::string(validate(world).message()),
              HasSubstr("body 'good::box': frame 2 must be at most 1, the number of frames"));
  world.bodies[0].pose.position.sector.frame = 1;
  EXPECT_TRUE(validate(world).ok());
  world.joints.resize(1);
  world.joints[0].name = "good::joint";
  world.joints[0].properties.parent.value = 2;
  world.joints[0].properties.child.value = 1;
  EXPECT_THAT(std::string(validate(world).message()), HasSubstr("its bodies are in different frames"));
  world.joints.clear();
  world.settings.seams = SeamPolicy::kClone;
  EXPECT_THAT(std::string(validate(world).message()), HasSubstr("need the seam policy island"));
}

}  // namespace
}  // namespace tessera
