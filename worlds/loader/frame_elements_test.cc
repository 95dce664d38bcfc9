// Frames that move in world files: what is read, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::HasSubstr;

TEST(MovingFrames, HoldWhatIsInThem) {
  const LoadedWorld loaded = load(world(
      model("outside", "<pose>1 0 0 0 0 0</pose>") +
      "<tessera:frame name='train' velocity='30 0 0' spin='0 0 0.1' tessera:sector='7 0 0'>"
      "<pose>0 2 0 0 0 0</pose><tessera:region size='40 5 8' centre='0 0 4'/>"
      "<tessera:leg seconds='2'/><tessera:leg seconds='3' acceleration='-1 0 0'/>" +
      model("inside", "<pose>150 0 0 0 0 0</pose>") + "<frame name='seat'><pose>0 1 0 0 0 0</pose></frame>" +
      model("seated", "<pose relative_to='seat'>0 0 1 0 0 0</pose>") +
      "</tessera:frame><tessera:frame name='lift' falls='true'>" + model("rider", "") + "</tessera:frame>"));
  const std::vector<MovingFrame>& frames = loaded.world.settings.frames;
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].name, "train");
  EXPECT_EQ(frames[0].start.position, (WorldPosition{{7, 0, 0}, {0, 2, 0}}));
  EXPECT_EQ(frames[0].velocity, Eigen::Vector3d(30, 0, 0));
  EXPECT_EQ(frames[0].spin, Eigen::Vector3d(0, 0, 0.1));
  ASSERT_TRUE(frames[0].region.has_value());
  EXPECT_EQ(frames[0].region->centre, Eigen::Vector3d(0, 0, 4));
  ASSERT_EQ(frames[0].legs.size(), 2u);
  EXPECT_EQ(frames[0].legs[1].seconds, 3);
  EXPECT_EQ(frames[0].legs[1].acceleration, Eigen::Vector3d(-1, 0, 0));
  EXPECT_FALSE(frames[0].falls);
  EXPECT_TRUE(frames[1].falls);
  const auto at = [&](const char* body) { return body_named(loaded, body).pose.position; };
  EXPECT_EQ(at("outside::l").sector, (SectorIndex{0, 0, 0}));
  EXPECT_EQ(at("inside::l"), (WorldPosition{{1, 0, 0, 1}, {22, 0, 0}}));
  EXPECT_EQ(at("seated::l"), (WorldPosition{{0, 0, 0, 1}, {0, 1, 1}}));
  EXPECT_EQ(at("rider::l").sector.frame, 2u);
}

TEST(MovingFrames, GoThroughKeys) {
  const LoadedWorld loaded =
      load(world("<tessera:frame name='tram' loops='true'><pose>5 0 0 0 0 1.5707963267948966</pose>"
                 "<tessera:key time='0'><pose>0 0 1 0 0 0</pose></tessera:key>"
                 "<tessera:key time='2.5' velocity='1 2 3' spin='0 0 0.5'><pose degrees='true'>3 4 1 0 0 "
                 "90</pose></tessera:key>"
                 "<tessera:key time='4'><pose>6 0 1 0 0 3</pose></tessera:key>"
                 "<tessera:key time='5'><pose>0 0 1 0 0 0</pose></tessera:key>" +
                 model("rider", "") + "</tessera:frame>"));
  const MovingFrame& tram = loaded.world.settings.frames.at(0);
  EXPECT_TRUE(tram.loops);
  EXPECT_EQ(tram.start.position, (WorldPosition{{}, {5, 0, 0}}));
  ASSERT_EQ(tram.keys.size(), 4u);
  EXPECT_EQ(tram.keys[1].time, 2.5);
  EXPECT_EQ(tram.keys[1].pose.position, Eigen::Vector3d(3, 4, 1));
  EXPECT_NEAR(tram.keys[1].pose.orientation.z(), std::sqrt(0.5), 1e-15);
  EXPECT_EQ(tram.keys[1].velocity, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(tram.keys[1].spin, Eigen::Vector3d(0, 0, 0.5));
  ASSERT_TRUE(tram.keys[0].velocity.has_value()) << "what is not said is found";
  EXPECT_FALSE(tram.keys[0].velocity->isZero());
  EXPECT_EQ(tram.keys[0].velocity, tram.keys[3].velocity);
  EXPECT_EQ(body_named(loaded, "rider::l").pose.position.sector.frame, 1u);
}

TEST(MovingFrames, MoveInOthers) {
  const LoadedWorld loaded =
      load(world("<tessera:frame name='planet' spin='0 0 0.1'><tessera:frame name='train' velocity='30 0 0'>"
                 "<pose>200 0 1 0 0 0</pose>" +
                 model("crate", "<pose>1 0 0 0 0 0</pose>") + "</tessera:frame>" + model("rock", "") +
                 "</tessera:frame>"));
  const std::vector<MovingFrame>& frames = loaded.world.settings.frames;
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].parent(), kWorldFrame);
  EXPECT_EQ(frames[1].parent(), 1u);
  EXPECT_EQ(frames[1].start.position, (WorldPosition{{2, 0, 0, 1}, {-56, 0, 1}}));
  EXPECT_EQ(body_named(loaded, "crate::l").pose.position.sector.frame, 2u);
  EXPECT_EQ(body_named(loaded, "rock::l").pose.position.sector.frame, 1u);
}

TEST(MovingFrames, MoveInOnesThatAreCarried) {
  const LoadedWorld loaded = load(world(
      model("ship", "") +
      "<tessera:frame name='deck' carrier='ship::l'>"
      "<tessera:frame name='table' spin='0 0 1'><pose>1 0 0 0 0 0</pose></tessera:frame></tessera:frame>"));
  ASSERT_EQ(loaded.world.settings.frames.size(), 2u);
  EXPECT_EQ(loaded.world.settings.frames[1].start.position, (WorldPosition{{0, 0, 0, 1}, {1, 0, 0}}));
}

TEST(MovingFrames, AreCarriedInFrames) {
  const LoadedWorld loaded =
      load(world("<tessera:frame name='planet' spin='0 0 0.1'><pose>5 0 0 0 0 0</pose>" +
                 model("ship", "<pose>3 0 0 0 0 0</pose><tessera:velocity linear='4 0 0'/>") +
                 "<tessera:frame name='deck' carrier='ship::l'><pose>0 0 2 0 0 "
                 "0</pose></tessera:frame></tessera:frame>"));
  const MovingFrame& deck = loaded.world.settings.frames.at(1);
  EXPECT_EQ(loaded.world.bodies[deck.carrier->body.value - 1].name, "ship::l");
  EXPECT_EQ(deck.start.position, (WorldPosition{{0, 0, 0, 1}, {3, 0, 2}}));
  EXPECT_EQ(deck.velocity, Eigen::Vector3d(4, 0, 0));
}

TEST(MovingFrames, AreCarried) {
  const LoadedWorld loaded = load(
      world("<tessera:frame name='deck' carrier='ship::l'><pose>0 0 2 0 0 0</pose>" +
            model("crate", "<pose>1 0 0 0 0 0</pose>") + "</tessera:frame>" +
            model("ship", "<pose>30 0 0 0 0 0</pose><tessera:velocity linear='4 0 0' angular='0 1 0'/>")));
  ASSERT_EQ(loaded.world.settings.frames.size(), 1u);
  const MovingFrame& deck = loaded.world.settings.frames.front();
  ASSERT_TRUE(deck.carrier.has_value());
  EXPECT_EQ(loaded.world.bodies[deck.carrier->body.value - 1].name, "ship::l");
  EXPECT_EQ(deck.carrier->pose.position, Eigen::Vector3d(0, 0, 2));
  EXPECT_LT(
      (relative_to(deck.start.position, {}, loaded.world.settings.sector_size) - Eigen::Vector3d(30, 0, 2))
          .norm(),
      1e-12);
  EXPECT_LT((deck.velocity - Eigen::Vector3d(6, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(deck.spin, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(body_named(loaded, "crate::l").pose.position.sector.frame, 1u);
}

struct BadFrame {
  std::string name;
  std::string xml;
  std::vector<std::string> said;

  friend void PrintTo(const BadFrame& frame, std::ostream* out) { *out << frame.name; }
};

// To carry a frame.
std::string ship(const std::string& of_model = "") {
  return absl::StrCat("<model name='ship'>", of_model,
                      "<link name='l'><collision name='c'><geometry><box><size>1 1 1</size></box></geometry>"
                      "</collision></link></model>");
}

std::vector<BadFrame> bad_frames() {
  return {
      {"WithoutName", world("<tessera:frame/>"), {"<tessera:frame>", "'name' is missing"}},
      {"Twice",
       world("<tessera:frame name='f'/><tessera:frame name='f'/>"),
       {"<tessera:frame name='f'>", "unique"}},
      {"InSite",
       world("<tessera:site name='s' latitude='1' longitude='2'><tessera:frame name='g'/></tessera:site>"),
       {"<tessera:frame name='g'>", "not allowed in a <tessera:site>"}},
      {"ThatFallsInFrame",
       world("<tessera:frame name='f'><tessera:frame name='g' falls='true'/></tessera:frame>"),
       {"frame 'g'", "it falls, and must start in the world frame"}},
      {"Attribute", world("<tessera:frame name='f' speed='1'/>"), {"unknown attribute 'speed'"}},
      {"Fast", world("<tessera:frame name='f' velocity='4e8 0 0'/>"), {"frame 'f'", "velocity", "3e+08 m/s"}},
      {"Falls", world("<tessera:frame name='f' falls='yes'/>"), {"'yes' must be false or true"}},
      {"Leg",
       world("<tessera:frame name='f'><tessera:leg seconds='0'/></tessera:frame>"),
       {"frame 'f'", "leg 1: seconds = 0"}},
      {"KeyTime",
       world("<tessera:frame name='f'><tessera:key time='0'/><tessera:key time='2'/><tessera:key time='1'/>"
             "</tessera:frame>"),
       {"frame 'f'", "key 3: time = 1 s must be at least 1e-05 s after"}},
      {"KeyAlone",
       world("<tessera:frame name='f'><tessera:key time='0'/></tessera:frame>"),
       {"frame 'f'", "its 1 keys must be at least 2 and at most 4096"}},
      {"KeyContents",
       world("<tessera:frame name='f'><tessera:key time='0'><place/></tessera:key></tessera:frame>"),
       {"<place>", "a <tessera:key> has one <pose>"}},
      {"KeyRelative",
       world("<tessera:frame name='f'><tessera:key time='0'><pose relative_to='g'>0 0 0 0 0 "
             "0</pose></tessera:key>"
             "</tessera:frame>"),
       {"<pose", "a key is relative to where its frame starts"}},
      {"KeyAndVelocity",
       world("<tessera:frame name='f' velocity='1 0 0'><tessera:key time='0'/><tessera:key "
             "time='1'/></tessera:frame>"),
       {"frame 'f'", "it has keys, and so no velocity"}},
      {"LoopsWithoutKeys",
       world("<tessera:frame name='f' loops='true'/>"),
       {"frame 'f'", "it loops, and must have keys"}},
      {"Region",
       world("<tessera:frame name='f'><tessera:region size='2 0 2'/></tessera:frame>"),
       {"frame 'f'", "region size y = 0 m"}},
      {"SpinWord",
       world("<tessera:frame name='f' spin='0 0 x'/>"),
       {"<tessera:frame name='f'>", "the attribute spin: 'x' is not a number"}},
      {"VelocityShort",
       world("<tessera:frame name='f' velocity='1 0'/>"),
       {"<tessera:frame name='f'>", "the attribute velocity: '1 0' must be 3 numbers"}},
      {"Relative",
       world("<tessera:frame name='f'><pose relative_to='g'>0 0 0 0 0 0</pose></tessera:frame>"),
       {"<pose>", "starts relative to the world"}},
      {"CarrierUnknown",
       world("<tessera:frame name='f' carrier='ship::hull'/>"),
       {"<tessera:frame name='f'>", "carrier 'ship::hull' is no body of the world"}},
      {"CarrierStatic",
       world(ship("<static>true</static>") + "<tessera:frame name='f' carrier='ship::l'/>"),
       {"frame 'f'", "body 'ship::l', must be dynamic or kinematic"}},
      {"CarrierSpeed",
       world(ship() + "<tessera:frame name='f' carrier='ship::l' velocity='1 0 0'/>"),
       {"<tessera:frame name='f'>", "there is no 'velocity'"}},
      {"CarrierFalls",
       world(ship() + "<tessera:frame name='f' carrier='ship::l' falls='true'/>"),
       {"frame 'f'", "neither falls nor has legs"}},
      {"CarrierInFrame",
       world("<tessera:frame name='g'>" + ship() +
             "</tessera:frame><tessera:frame name='f' carrier='ship::l'/>"),
       {"<tessera:frame name='f'>", "must be in the same frame as this element"}},
      {"InFrameWithCarrier",
       world(ship() + "<tessera:frame name='g'><tessera:frame name='f' carrier='ship::l'/></tessera:frame>"),
       {"<tessera:frame name='f'>", "must be in the same frame as this element"}},
  };
}

class BadFrames : public testing::TestWithParam<BadFrame> {};

TEST_P(BadFrames, AreRefused) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(GetParam().xml, "/");
  EXPECT_EQ(loaded.status().code(), absl::StatusCode::kInvalidArgument) << loaded.status();
  for (const std::string& part : GetParam().said)
    EXPECT_THAT(std::string(loaded.status().message()), HasSubstr(part));
}

INSTANTIATE_TEST_SUITE_P(Elements, BadFrames, testing::ValuesIn(bad_frames()),
                         [](const auto& row) { return row.param.name; });

}  // namespace
}  // namespace tessera
