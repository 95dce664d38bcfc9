// Joints of the world itself, between models.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

// Two models of one link each, the second 2 m above the first and turned about x.
const std::string kTwoModels =
    model("low", "<pose>1 2 3 0 0 1.5707963267948966</pose>") +
    model("high",
          "<pose>1 2 5 1.5707963267948966 0 0</pose><frame name='side'><pose>0 0.5 0 0 0 0</pose></frame>");

std::string joint_between(const std::string& parent, const std::string& child, const std::string& more,
                          const std::string& type = "revolute") {
  return absl::StrCat("<joint name='j' type='", type, "'><parent>", parent, "</parent><child>", child,
                      "</child>", more, "</joint>");
}

const std::string kAxisZ = "<axis><xyz>0 0 1</xyz></axis>";

JointProperties the_joint(const LoadedWorld& loaded) {
  EXPECT_EQ(loaded.world.joints.size(), 1u);
  return loaded.world.joints.empty() ? JointProperties{} : loaded.world.joints[0].properties;
}

Pose body_pose(const LoadedWorld& loaded, BodyId id) {
  const WorldPose& pose = loaded.world.bodies.at(id.value - 1).pose;
  return {relative_to(pose.position, {}, loaded.world.settings.sector_size), pose.orientation};
}

// The joint frame in the world, which both bodies must agree on.
Pose agreed_frame(const LoadedWorld& loaded, const JointProperties& joint) {
  const Pose child = body_pose(loaded, joint.child) * joint.in_child;
  const Pose parent = body_pose(loaded, joint.parent) * joint.in_parent;
  expect_near(parent.position, child.position);
  EXPECT_LT(parent.orientation.angularDistance(child.orientation), 1e-7);
  return child;
}

TEST(WorldJoint, StandsAtTheChild) {
  const LoadedWorld loaded = load(world(kTwoModels + joint_between("low::l", "high::l", kAxisZ), "1.10"));
  const JointProperties hinge = the_joint(loaded);
  EXPECT_EQ(loaded.world.joints[0].name, "j");
  EXPECT_EQ(hinge.type, JointType::kRevolute);
  EXPECT_EQ(hinge.parent, BodyId{1});
  EXPECT_EQ(hinge.child, BodyId{2});
  const Pose frame = agreed_frame(loaded, hinge);
  expect_near(frame.position, {1, 2, 5});
  expect_near(frame.orientation * Eigen::Vector3d::UnitX(), {0, -1, 0});
  EXPECT_THAT(loaded.notices, Contains("1 joint (1 revolute) simulated"));
}

TEST(WorldJoint, ReadsLimitsDrivesAndAxesInOtherFrames) {
  const LoadedWorld loaded = load(world(
      kTwoModels +
          joint_between("low::l", "high::l",
                        "<pose relative_to='low'>0 0 1 0 0 0</pose><axis><xyz expressed_in='low'>0 3 0</xyz>"
                        "<limit><lower>-1</lower><upper>2</upper></limit></axis>"
                        "<tessera:drive mode='velocity' target='3'/>",
                        "prismatic"),
      "1.10"));
  const JointProperties slide = the_joint(loaded);
  EXPECT_EQ(slide.axes[0].lower, -1);
  EXPECT_EQ(slide.axes[0].upper, 2);
  EXPECT_EQ(loaded.world.joints[0].drives[0], (JointDrive{DriveMode::kVelocity, 3}));
  const Pose frame = agreed_frame(loaded, slide);
  expect_near(frame.position, {1, 2, 4});
  expect_near(frame.orientation * Eigen::Vector3d::UnitX(), {-1, 0, 0});
}

// A model stands for its canonical link, a frame for what it is attached to, here or in a model.
TEST(WorldJoint, FindsTheBodiesOfModelsFramesAndJoints) {
  const std::string frames = "<frame name='f' attached_to='g'/><frame name='g' attached_to='high::side'/>";
  for (const std::string child : {"high", "high::__model__", "high::side", "f"}) {
    const LoadedWorld loaded = load(world(kTwoModels + frames + joint_between("low", child, kAxisZ), "1.10"));
    EXPECT_EQ(the_joint(loaded).child, BodyId{2}) << child;
    const Eigen::Vector3d place = agreed_frame(loaded, the_joint(loaded)).position;
    expect_near(
        place, child == "f" || child == "high::side" ? Eigen::Vector3d(1, 2, 5.5) : Eigen::Vector3d(1, 2, 5));
  }
  const std::string nested = "<model name='outer'>" + model("inner", "") + "</model>";
  EXPECT_EQ(the_joint(load(world(kTwoModels + nested + joint_between("low", "outer::inner", kAxisZ)))).child,
            BodyId{3});
}

TEST(WorldJoint, ConnectsWithTheWorldAndWithWhatCannotMove) {
  const LoadedWorld to_world = load(world(kTwoModels + joint_between("world", "high", "", "ball")));
  EXPECT_EQ(the_joint(to_world).parent, BodyId{});
  expect_near(the_joint(to_world).in_parent.position, {1, 2, 5});
  const std::string fixed = model("wall", "<static>true</static><pose>4 0 0 0 0 0</pose>");
  const LoadedWorld exchanged = load(world(kTwoModels + fixed + joint_between("low", "wall", kAxisZ)));
  EXPECT_EQ(the_joint(exchanged).parent, BodyId{3});
  EXPECT_EQ(the_joint(exchanged).child, BodyId{1});
  expect_near(agreed_frame(exchanged, the_joint(exchanged)).position, {4, 0, 0});
}

// Where one is 2^62 sectors away.
TEST(WorldJoint, KeepsItsPlaceFarAway) {
  const std::string far = "tessera:sector='4611686018427387904 0 -7'";
  const auto at = [&](const std::string& name, const std::string& pose) {
    return absl::StrCat("<model name='", name, "' ", far, "><pose>", pose, "</pose><link name='l'>", kUnitBox,
                        "</link></model>");
  };
  const LoadedWorld loaded =
      load(world(at("a", "0 0 0 0 0 0") + at("b", "0 0 2 0 0 0") + joint_between("a", "b", "", "ball")));
  expect_near(the_joint(loaded).in_parent.position, {0, 0, 2});
  expect_near(the_joint(loaded).in_child.position, {0, 0, 0});
}

// As in gz-sim's joints_in_world.sdf.
TEST(WorldJoint, HoldsLinksWithoutShape) {
  const std::string bare = model("bare", "", "");
  for (const std::string child : {"bare", "bare::l"}) {
    const LoadedWorld loaded = load(world(kTwoModels + bare + joint_between("low", child, kAxisZ)));
    EXPECT_THAT(names(loaded), ElementsAre("low::l", "high::l", "bare::l"));
    EXPECT_EQ(the_joint(loaded).child, BodyId{3});
  }
}

TEST(WorldJoint, IsNamedWhereItIsLeftOut) {
  const std::string bare = model("bare", "", "") + "<frame name='f' attached_to='bare'/>";
  EXPECT_THAT(load(world(kTwoModels + bare + joint_between("low", "f", kAxisZ))).notices,
              Contains(HasSubstr("revolute with a link that has no collision shape")));
  EXPECT_THAT(load(world(kTwoModels + joint_between("low", "high", kAxisZ + kAxisZ, "gearbox"))).notices,
              Contains(HasSubstr("gearbox")));
}

struct BadJoint {
  std::string name;
  std::string text;
  std::string message;
};

class BadWorldJoint : public testing::TestWithParam<BadJoint> {};

TEST_P(BadWorldJoint, IsRefusedByName) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(world(kTwoModels + GetParam().text), "/");
  EXPECT_EQ(loaded.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(loaded.status().message(), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadWorldJoint,
    testing::Values(
        BadJoint{"NoModel", joint_between("low", "hihg", kAxisZ),
                 "there is no link, model, frame or joint 'hihg'"},
        BadJoint{"NoLink", joint_between("low", "high::k", kAxisZ),
                 "there is no link, frame or joint 'high::k'"},
        BadJoint{"NoChild", "<joint name='j' type='ball'><parent>low</parent></joint>", "<child> is missing"},
        BadJoint{"ChildWorld", joint_between("low", "world", kAxisZ), "the child must not be the world"},
        BadJoint{"OneBody", joint_between("low", "low::l", kAxisZ), "the same body"},
        BadJoint{"Circle",
                 "<frame name='f' attached_to='g'><pose relative_to='world'>0 0 0 0 0 0</pose></frame><frame "
                 "name='g' attached_to='f'><pose relative_to='world'>0 0 0 0 0 0</pose></frame>" +
                     joint_between("low", "f", kAxisZ),
                 "attached to itself"},
        BadJoint{"Type", joint_between("low", "high", kAxisZ, "revolut"), "the nearest is revolute"},
        BadJoint{"Axis", joint_between("low", "high", "<axis><xyz>0 0 0</xyz></axis>"),
                 "<joint name='j'>: libsdformat: The norm of the xyz vector cannot be zero"},
        BadJoint{"Frame", joint_between("low", "high", "<axis><xyz expressed_in='x'>0 0 1</xyz></axis>"),
                 "there is no frame 'x'"},
        BadJoint{"Name", joint_between("low", "high", kAxisZ) + joint_between("low", "high", kAxisZ),
                 "must be unique"}),
    [](const testing::TestParamInfo<BadJoint>& bad) { return bad.param.name; });

}  // namespace
}  // namespace tessera
