// Joints of SDF and URDF files.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using std::numbers::pi;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string link(const std::string& name, const std::string& pose = "0 0 0 0 0 0") {
  return absl::StrCat("<link name='", name, "'><pose>", pose, "</pose>", kUnitBox, "</link>");
}

std::string joint(const std::string& type, const std::string& more, const std::string& parent = "a",
                  const std::string& child = "b") {
  return absl::StrCat("<joint name='j' type='", type, "'><parent>", parent, "</parent><child>", child,
                      "</child>", more, "</joint>");
}

std::string axis(const std::string& xyz, const std::string& more = "", const std::string& name = "axis") {
  return absl::StrCat("<", name, "><xyz>", xyz, "</xyz>", more, "</", name, ">");
}

// A model 'm' of two links, the second 2 m above the first and turned, and a joint.
LoadedWorld with_joint(const std::string& joint_text, const std::string& of_model = "") {
  return load(
      world(absl::StrCat("<model name='m'><pose>1 2 3 0 0 1.5707963267948966</pose>", of_model, link("a"),
                         link("b", "0 0 2 1.5707963267948966 0 0"), joint_text, "</model>")));
}

JointDescription only_joint(const LoadedWorld& loaded) {
  EXPECT_EQ(loaded.world.joints.size(), 1u);
  return loaded.world.joints.empty() ? JointDescription{} : loaded.world.joints[0];
}

Pose near_origin(const LoadedWorld& loaded, BodyId place) {
  const WorldPose& pose = loaded.world.bodies.at(place.value - 1).pose;
  return {relative_to(pose.position, {}, loaded.world.settings.sector_size), pose.orientation};
}

// The joint frame in the world, as the child has it and as the parent has it.
Pose frame_of(const LoadedWorld& loaded, const JointProperties& joint) {
  const Pose child = near_origin(loaded, joint.child) * joint.in_child;
  const Pose parent =
      joint.parent.value == 0
          ? Pose{relative_to({joint.anchor, joint.in_parent.position}, {}, loaded.world.settings.sector_size),
                 joint.in_parent.orientation}
          : near_origin(loaded, joint.parent) * joint.in_parent;
  expect_near(parent.position, child.position);
  EXPECT_LT(parent.orientation.angularDistance(child.orientation), 1e-7);
  return child;
}

TEST(Joints, StandAtTheChildWithXAlongTheAxis) {
  const LoadedWorld loaded = with_joint(joint("revolute", axis("0 0 1")));
  const JointDescription hinge = only_joint(loaded);
  EXPECT_EQ(hinge.name, "m::j");
  EXPECT_EQ(hinge.properties.type, JointType::kRevolute);
  EXPECT_EQ(hinge.properties.parent, BodyId{1});
  EXPECT_EQ(hinge.properties.child, BodyId{2});
  EXPECT_FALSE(hinge.properties.bodies_collide);
  EXPECT_EQ(hinge.properties.in_child.position, Eigen::Vector3d::Zero());
  const Pose frame = frame_of(loaded, hinge.properties);
  expect_near(frame.position, {1, 2, 5});
  // The child is turned about the model's x, and the model about z.
  expect_near(frame.orientation * Eigen::Vector3d::UnitX(), {1, 0, 0});
  EXPECT_THAT(loaded.notices, ElementsAre("1 joint (1 revolute) simulated"));
}

TEST(Joints, AxesAndPosesInOtherFrames) {
  const LoadedWorld loaded = with_joint(joint(
      "prismatic",
      "<pose relative_to='a'>0 0 1 0 0 0</pose><axis><xyz expressed_in='__model__'>0 3 0</xyz></axis>"));
  const JointDescription slide = only_joint(loaded);
  EXPECT_EQ(slide.properties.type, JointType::kPrismatic);
  const Pose frame = frame_of(loaded, slide.properties);
  expect_near(frame.position, {1, 2, 4});
  expect_near(frame.orientation * Eigen::Vector3d::UnitX(), {-1, 0, 0});
}

TEST(Joints, ToTheWorld) {
  const LoadedWorld loaded = with_joint(joint("ball", "", "world"));
  const JointDescription ball = only_joint(loaded);
  EXPECT_EQ(ball.properties.type, JointType::kBall);
  EXPECT_EQ(ball.properties.parent, BodyId{});
  EXPECT_EQ(ball.properties.child, BodyId{2});
  expect_near(frame_of(loaded, ball.properties).position, {1, 2, 5});
}

TEST(Joints, ToTheWorldFarAway) {
  const LoadedWorld loaded = load(world("<model name='m' tessera:sector='4611686018427387904 0 -7'>" +
                                        link("b") + joint("ball", "", "world") + "</model>"));
  EXPECT_EQ(only_joint(loaded).properties.anchor, (SectorIndex{std::int64_t{1} << 62, 0, -7}));
}

// The coordinate stays what it was: the static base is the parent now, and the axis points the other way.
TEST(Joints, AChildThatCannotMoveBecomesTheParent) {
  const LoadedWorld loaded =
      with_joint("<joint name='f' type='fixed'><parent>world</parent><child>b</child></joint>" +
                 joint("revolute", axis("0 0 1", "<limit><lower>-1</lower><upper>2</upper></limit>")));
  const JointDescription hinge = only_joint(loaded);
  EXPECT_EQ(hinge.properties.parent, BodyId{2});
  EXPECT_EQ(hinge.properties.child, BodyId{1});
  EXPECT_EQ(hinge.properties.axes[0].lower, -1);
  EXPECT_EQ(hinge.properties.axes[0].upper, 2);
  expect_near(frame_of(loaded, hinge.properties).orientation * Eigen::Vector3d::UnitX(), {-1, 0, 0});
  EXPECT_THAT(loaded.notices, Contains("1 x link fixed to the world, treated as static"));
}

TEST(Joints, AxesOfAUniversalJointThatChangesItsSides) {
  const LoadedWorld loaded =
      with_joint("<joint name='f' type='fixed'><parent>world</parent><child>b</child></joint>" +
                 joint("universal", axis("1 0 0", "<dynamics><damping>1</damping></dynamics>") +
                                        axis("0 1 0", "<dynamics><damping>2</damping></dynamics>", "axis2") +
                                        "<tessera:drive axis='2' mode='velocity' target='3'/>"));
  const JointDescription cross = only_joint(loaded);
  EXPECT_EQ(cross.properties.axes[0].damping, 2);
  EXPECT_EQ(cross.properties.axes[1].damping, 1);
  EXPECT_EQ(cross.drives[0], (JointDrive{DriveMode::kVelocity, 3}));
  const Pose frame = frame_of(loaded, cross.properties);
  expect_near(frame.orientation * Eigen::Vector3d::UnitX(), {0, 0, -1});
  expect_near(frame.orientation * Eigen::Vector3d::UnitY(), {0, -1, 0});
}

TEST(Joints, LimitsAndDynamics) {
  const LoadedWorld loaded = with_joint(joint(
      "revolute",
      axis("1 0 0",
           "<limit><lower>-0.5</lower><upper>0.75</upper><effort>10</effort><velocity>2</velocity></limit>"
           "<dynamics><damping>0.1</damping><friction>0.2</friction></dynamics>")));
  const JointAxis read = only_joint(loaded).properties.axes[0];
  EXPECT_EQ(read.lower, -0.5);
  EXPECT_EQ(read.upper, 0.75);
  EXPECT_EQ(read.effort_max, 10);
  EXPECT_EQ(read.velocity_max, 2);
  EXPECT_EQ(read.damping, 0.1);
  EXPECT_EQ(read.friction, 0.2);
}

TEST(Joints, AreFreeWhereTheFileSaysNothing) {
  const JointAxis read = only_joint(with_joint(joint("revolute", axis("1 0 0")))).properties.axes[0];
  EXPECT_EQ(read.lower, -kUnbounded);
  EXPECT_EQ(read.upper, kUnbounded);
  EXPECT_EQ(read.effort_max, kUnbounded);
  EXPECT_EQ(read.velocity_max, kUnbounded);
}

TEST(Joints, AnglesAreKnownUpToHalfATurn) {
  const auto limited = [](const std::string& type, double lower, double upper) {
    return with_joint(joint(type, axis("1 0 0", absl::StrCat("<limit><lower>", lower, "</lower><upper>",
                                                             upper, "</upper></limit>"))));
  };
  const LoadedWorld free = limited("revolute", -6.28, 6.28);
  EXPECT_EQ(only_joint(free).properties.axes[0].lower, -kUnbounded);
  EXPECT_EQ(only_joint(free).properties.axes[0].upper, kUnbounded);
  EXPECT_THAT(free.notices, Contains(HasSubstr("full turn")));
  const LoadedWorld half = limited("revolute", -4, 1);
  EXPECT_EQ(only_joint(half).properties.axes[0].lower, -pi);
  EXPECT_EQ(only_joint(half).properties.axes[0].upper, 1);
  EXPECT_THAT(half.notices, Contains(HasSubstr("beyond half a turn")));
  EXPECT_EQ(only_joint(limited("prismatic", -4, 100)).properties.axes[0].upper, 100);
}

TEST(Joints, UniversalWhereAxesAreAtRightAngles) {
  const LoadedWorld loaded = with_joint(joint("revolute2", axis("0 0 1") + axis("1 0 0", "", "axis2")));
  const JointDescription cross = only_joint(loaded);
  EXPECT_EQ(cross.properties.type, JointType::kUniversal);
  const Pose child = cross.properties.in_child;
  expect_near(child.orientation * Eigen::Vector3d::UnitX(), {0, 0, 1});
  expect_near(child.orientation * Eigen::Vector3d::UnitY(), {1, 0, 0});
  EXPECT_THAT(loaded.notices, ElementsAre("1 joint (1 revolute2) simulated"));

  const LoadedWorld skew = with_joint(joint("revolute2", axis("0 0 1") + axis("1 0 1", "", "axis2")));
  EXPECT_THAT(skew.world.joints, IsEmpty());
  EXPECT_THAT(
      skew.notices,
      ElementsAre("1 joint (1 revolute2 with axes not at right angles) not simulated: their links move "
                  "freely"));
}

TEST(Joints, PitchOfScrews) {
  const auto pitch = [](const std::string& element) {
    return only_joint(with_joint(joint("screw", axis("0 0 1") + element))).properties.pitch;
  };
  EXPECT_DOUBLE_EQ(pitch("<thread_pitch>-500</thread_pitch>"), 0.002);
  EXPECT_DOUBLE_EQ(pitch("<screw_thread_pitch>0.01</screw_thread_pitch>"), 0.01 / (2 * pi));
}

TEST(Joints, WhatIsNotSimulatedIsNamed) {
  const LoadedWorld loaded = with_joint(joint(
      "gearbox", axis("0 0 1") + axis("0 0 1", "", "axis2") +
                     "<gearbox_ratio>2</gearbox_ratio><gearbox_reference_body>a</gearbox_reference_body>"));
  EXPECT_THAT(loaded.world.joints, IsEmpty());
  EXPECT_THAT(loaded.notices,
              ElementsAre("1 joint (1 gearbox without hinges of both links on its reference body) not "
                          "simulated: their links move freely"));
}

TEST(Joints, Springs) {
  const LoadedWorld loaded =
      with_joint(joint("revolute", axis("0 0 1",
                                        "<dynamics><spring_reference>0.5</spring_reference>"
                                        "<spring_stiffness>5</spring_stiffness></dynamics>")));
  EXPECT_EQ(only_joint(loaded).properties.axes[0].spring_stiffness, 5);
  EXPECT_EQ(only_joint(loaded).properties.axes[0].spring_reference, 0.5);
  EXPECT_THAT(loaded.notices, ElementsAre("1 joint (1 revolute) simulated"));
}

// A model 'm' of a base and two links on it, which turn about z and about `second`.
LoadedWorld with_two(const std::string& first_of_axis, const std::string& second_of_axis,
                     const std::string& more = "", const std::string& second = "0 0 1") {
  const auto hinge = [](const std::string& name, const std::string& child, const std::string& its_axis) {
    return absl::StrCat("<joint name='", name, "' type='revolute'><parent>a</parent><child>", child,
                        "</child>", its_axis, "</joint>");
  };
  return load(world("<model name='m'>" + link("a") + link("b", "2 0 0 0 0 0") + link("c", "4 0 0 0 0 0") +
                    hinge("first", "b", axis("0 0 1", first_of_axis)) +
                    hinge("second", "c", axis(second, second_of_axis)) + more + "</model>"));
}

TEST(Joints, FollowOthers) {
  const LoadedWorld loaded = with_two(
      "<mimic "
      "joint='second'><multiplier>-3.7</multiplier><offset>0.1</offset><reference>0.2</reference></mimic>",
      "");
  ASSERT_EQ(loaded.world.joints.size(), 2u);
  const AxisMimic& mimic = loaded.world.joints[0].properties.axes[0].mimic;
  EXPECT_EQ(mimic.leader, JointId{2});
  EXPECT_EQ(mimic.axis, 0);
  EXPECT_EQ(mimic.multiplier, -3.7);
  EXPECT_EQ(mimic.offset, 0.1);
  EXPECT_EQ(mimic.reference, 0.2);
  EXPECT_FALSE(loaded.world.joints[1].properties.axes[0].mimic.is_set());
  EXPECT_THAT(loaded.notices, ElementsAre("2 joints (2 revolute) simulated"));
}

TEST(Joints, FollowOthersOfTheirOwnModel) {
  std::string models;
  for (int n = 0; n < 2; ++n) {
    absl::StrAppend(&models, "<model name='m", n, "'><pose>", 10 * n, " 0 0 0 0 0</pose>", link("a"),
                    link("b", "0 0 2 0 0 0"), link("c", "0 0 4 0 0 0"), joint("revolute", axis("0 0 1")),
                    "<joint name='k' type='revolute'><parent>b</parent><child>c</child>",
                    axis("0 0 1", "<mimic joint='j'/>"), "</joint></model>");
  }
  const LoadedWorld loaded = load(world(models));
  ASSERT_EQ(loaded.world.joints.size(), 4u);
  EXPECT_EQ(loaded.world.joints[1].properties.axes[0].mimic.leader, JointId{1});
  EXPECT_EQ(loaded.world.joints[3].properties.axes[0].mimic.leader, JointId{3});
}

TEST(Joints, GearboxesConnectHinges) {
  const auto gearbox = [](const std::string& first, const std::string& second) {
    return "<joint name='g' type='gearbox'><parent>b</parent><child>c</child>" + axis(first) +
           axis(second, "", "axis2") +
           "<gearbox_ratio>2.5</gearbox_ratio><gearbox_reference_body>a</gearbox_reference_body></joint>";
  };
  const LoadedWorld loaded = with_two("", "", gearbox("0 0 1", "0 0 1"));
  ASSERT_EQ(loaded.world.joints.size(), 2u);
  EXPECT_EQ(loaded.world.joints[1].properties.axes[0].mimic.leader, JointId{1});
  EXPECT_EQ(loaded.world.joints[1].properties.axes[0].mimic.multiplier, -2.5);
  EXPECT_THAT(loaded.notices, ElementsAre("3 joints (1 gearbox, 2 revolute) simulated"));
  const LoadedWorld turned = with_two("", "", gearbox("0 0 1", "0 0 1"), "0 0 -1");
  EXPECT_EQ(turned.world.joints[1].properties.axes[0].mimic.multiplier, 2.5);
}

TEST(Joints, Drives) {
  const LoadedWorld loaded =
      with_joint(joint("revolute", axis("0 0 1") + "<tessera:drive mode='position' target='0.1'/>"));
  EXPECT_EQ(only_joint(loaded).drives, (JointDrives{JointDrive{DriveMode::kPosition, 0.1}, {}}));
}

TEST(Joints, ServosHaveGains) {
  const LoadedWorld loaded =
      with_joint(joint("revolute", axis("0 0 1") + "<tessera:drive mode='servo' target='0.1' stiffness='200' "
                                                   "damping='20' velocity='-1' effort='3'/>"));
  EXPECT_EQ(only_joint(loaded).drives, (JointDrives{JointDrive{DriveMode::kServo, 0.1, 200, 20, -1, 3}, {}}));
}

TEST(Joints, OfNestedModels) {
  const std::string nested = "<model name='arm'><pose>0 0 1 0 0 0</pose>" + link("c") + link("d") +
                             joint("fixed", "", "c", "d") + "</model>";
  const LoadedWorld loaded = with_joint(nested + joint("revolute", axis("1 0 0"), "a", "arm::c"));
  ASSERT_EQ(loaded.world.joints.size(), 2u);
  EXPECT_EQ(loaded.world.joints[0].name, "m::j");
  EXPECT_EQ(loaded.world.bodies[loaded.world.joints[0].properties.child.value - 1].name, "m::arm::c");
  EXPECT_EQ(loaded.world.joints[1].name, "m::arm::j");
  expect_near(frame_of(loaded, loaded.world.joints[0].properties).position, {1, 2, 4});
}

TEST(Joints, AreSharedByModelsThatAreEqual) {
  std::string models;
  for (int n = 0; n < 3; ++n) {
    absl::StrAppend(&models, "<model name='m", n, "'><pose>", 10 * n, " 0 0 0 0 0</pose>", link("a"),
                    link("b", "0 0 2 0 0 0"), joint("revolute", axis("0 0 1")), "</model>");
  }
  const LoadedWorld loaded = load(world(models));
  ASSERT_EQ(loaded.world.joints.size(), 3u);
  EXPECT_EQ(loaded.world.joints[2].name, "m2::j");
  EXPECT_EQ(loaded.world.joints[2].properties.parent, BodyId{5});
  EXPECT_EQ(loaded.world.joints[2].properties.child, BodyId{6});
  EXPECT_EQ(body_named(loaded, "m0::a").properties.assembly, body_named(loaded, "m0::b").properties.assembly);
  EXPECT_NE(body_named(loaded, "m0::a").properties.assembly, body_named(loaded, "m1::a").properties.assembly);
}

TEST(Joints, LinksOfAModelCollideIfItSaysSo) {
  const std::string hinge = joint("revolute", axis("0 0 1"));
  EXPECT_NE(body_named(with_joint(hinge), "m::a").properties.assembly, 0u);
  EXPECT_NE(body_named(with_joint(hinge, "<self_collide>false</self_collide>"), "m::b").properties.assembly,
            0u);
  EXPECT_EQ(body_named(with_joint(hinge, "<self_collide>true</self_collide>"), "m::a").properties.assembly,
            0u);
  EXPECT_EQ(body_named(load(world(model("one", ""))), "one::l").properties.assembly, 0u);
}

const FrameDescription& frame_named(const LoadedWorld& loaded, const std::string& name) {
  for (const FrameDescription& frame : loaded.world.frames) {
    if (frame.name == name) return frame;
  }
  ADD_FAILURE() << "there is no frame " << name;
  static const FrameDescription kNone;
  return kNone;
}

// Links that fixed joints connect become one body, of which the others are frames.
TEST(Frames, OfLinksThatUrdfFixesToOthers) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";
  const std::string box = "<collision><geometry><box size='1 1 1'/></geometry></collision>";
  const LoadedWorld loaded = load(absl::StrCat(
      "<robot name='r'><link name='base'>", inertial, box, "</link><link name='hand'>", inertial, box,
      "</link><link name='camera'/><link name='lens'/>",
      "<joint name='wrist' type='continuous'><parent link='base'/><child link='hand'/><axis xyz='0 0 1'/>"
      "<origin xyz='0 0 2'/></joint>"
      "<joint name='mount' type='fixed'><parent link='hand'/><child link='camera'/>"
      "<origin xyz='1 0 0' rpy='0 0 1.5707963267948966'/></joint>"
      "<joint name='screw' type='fixed'><parent link='camera'/><child link='lens'/>"
      "<origin xyz='0.5 0 0'/></joint></robot>"));
  EXPECT_THAT(names(loaded), ElementsAre("r::base", "r::hand"));
  const FrameDescription& camera = frame_named(loaded, "r::camera");
  EXPECT_EQ(loaded.world.bodies.at(camera.body).name, "r::hand");
  expect_near(camera.pose.position, {1, 0, 0}, 1e-9);
  expect_near(camera.pose.orientation * Eigen::Vector3d::UnitX(), {0, 1, 0}, 1e-9);
  const FrameDescription& lens = frame_named(loaded, "r::lens");
  EXPECT_EQ(loaded.world.bodies.at(lens.body).name, "r::hand");
  expect_near(lens.pose.position, {1, 0.5, 0}, 1e-9);
}

TEST(Frames, OfSdfModelsGoWithTheirLinks) {
  const LoadedWorld loaded =
      load(world(absl::StrCat("<model name='m'><pose>1 2 3 0 0 0</pose>", link("a"), link("b", "0 0 2 0 0 0"),
                              "<frame name='f' attached_to='b'><pose>0.5 0 0 0 0 0</pose></frame>",
                              "<frame name='g' attached_to='f'><pose>0 0.5 0 0 0 0</pose></frame></model>")));
  const FrameDescription& g = frame_named(loaded, "m::g");
  EXPECT_EQ(loaded.world.bodies.at(g.body).name, "m::b");
  expect_near(g.pose.position, {0.5, 0.5, 0}, 1e-9);
}

TEST(Joints, OfUrdf) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";
  std::string links;
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    absl::StrAppend(&links, "<link name='", name, "'>", inertial,
                    "<collision><geometry><box size='1 1 1'/></geometry></collision></link>");
  }
  const auto urdf_joint = [](const std::string& name, const std::string& type, const std::string& child,
                             const std::string& more) {
    return absl::StrCat("<joint name='", name, "' type='", type, "'><parent link='a'/><child link='", child,
                        "'/><origin xyz='0 0 2'/><axis xyz='0 1 0'/>", more, "</joint>");
  };
  const LoadedWorld loaded = load(
      "<robot name='r'>" + links +
      urdf_joint(
          "turn", "continuous", "b",
          "<dynamics damping='0.5' friction='0.25'/><mimic joint='slide' multiplier='-2' offset='0.5'/>") +
      urdf_joint("slide", "prismatic", "c", "<limit lower='-1' upper='2' effort='3' velocity='4'/>") +
      urdf_joint("glide", "planar", "d", "") + urdf_joint("fly", "floating", "e", "") + "</robot>");
  ASSERT_EQ(loaded.world.joints.size(), 2u);
  const JointProperties& slide =
      loaded.world.joints[loaded.world.joints[0].name == "r::slide" ? 0 : 1].properties;
  const JointProperties& turn =
      loaded.world.joints[loaded.world.joints[0].name == "r::turn" ? 0 : 1].properties;
  EXPECT_EQ(turn.type, JointType::kRevolute);
  EXPECT_EQ(turn.axes[0].lower, -kUnbounded);
  EXPECT_EQ(turn.axes[0].damping, 0.5);
  EXPECT_EQ(turn.axes[0].friction, 0.25);
  EXPECT_EQ(slide.type, JointType::kPrismatic);
  EXPECT_EQ(slide.axes[0].lower, -1);
  EXPECT_EQ(slide.axes[0].upper, 2);
  EXPECT_EQ(slide.axes[0].effort_max, 3);
  EXPECT_EQ(slide.axes[0].velocity_max, 4);
  expect_near(frame_of(loaded, slide).orientation * Eigen::Vector3d::UnitX(), {0, 1, 0});
  const AxisMimic& mimic = turn.axes[0].mimic;
  EXPECT_EQ(loaded.world.joints.at(mimic.leader.value - 1).name, "r::slide");
  EXPECT_EQ(mimic.multiplier, -2);
  EXPECT_EQ(mimic.offset, 0.5);
  EXPECT_FALSE(slide.axes[0].mimic.is_set());
  EXPECT_THAT(loaded.notices,
              Contains("2 joints (1 floating, 1 planar) not simulated: their links move freely"));
}

}  // namespace
}  // namespace tessera
