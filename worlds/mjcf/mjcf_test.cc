// What becomes of the elements of MuJoCo's files.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <variant>

#include "worlds/loader/model_file.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera::mjcf {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::string mujoco(const std::string& of_world, const std::string& more = "") {
  return absl::StrCat("<mujoco model='m'><worldbody>", of_world, "</worldbody>", more, "</mujoco>");
}

constexpr char kBallGeom[] = "<geom type='sphere' size='0.1' mass='1'/>";

std::string moving(const std::string& name, const std::string& of_body, const std::string& place = "0 0 0") {
  return absl::StrCat("<body name='", name, "' pos='", place, "'>", of_body, kBallGeom, "</body>");
}

std::string hinged(const std::string& of_joint, const std::string& more = "") {
  return mujoco(moving("b", absl::StrCat("<joint name='j' ", of_joint, "/>")), more);
}

const JointDescription& joint_named(const LoadedWorld& loaded, const std::string& name) {
  for (const JointDescription& joint : loaded.world.joints) {
    if (joint.name == name) return joint;
  }
  ADD_FAILURE() << "there is no joint " << name;
  static const JointDescription none;
  return none;
}

TEST(Mjcf, IsKnownByItsRoot) {
  const LoadedWorld loaded = load(mujoco(moving("b", "<freejoint/>", "1 2 3")));
  EXPECT_EQ(loaded.world.name, "m");
  EXPECT_THAT(names(loaded), ElementsAre("m::b"));
  expect_near(place(loaded, "m::b"), {1, 2, 3});
  EXPECT_EQ(body_named(loaded, "m::b").properties.motion, Motion::kDynamic);
  EXPECT_DOUBLE_EQ(body_named(loaded, "m::b").properties.mass, 1);
}

TEST(Mjcf, IsOneModelThatCanBeSpawned) {
  const auto model =
      load_model_string(mujoco(moving("a", "<freejoint/>") + moving("b", "<freejoint/>", "1 0 0")));
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(model_name(*model), "m");
}

TEST(Mjcf, SettingsAreGravityAndAStepThatTheFileNames) {
  const LoadedWorld own = load(
      "<mujoco><option timestep='0.004' gravity='0 0 -3'/><worldbody><geom size='1'/>"
      "</worldbody></mujoco>");
  EXPECT_DOUBLE_EQ(own.world.settings.time_step, 0.004);
  expect_near(std::get<UniformGravity>(own.world.settings.gravity).acceleration, {0, 0, -3});
  const LoadedWorld none = load(
      "<mujoco><option><flag gravity='disable'/></option><worldbody><geom size='1'/>"
      "</worldbody></mujoco>");
  EXPECT_DOUBLE_EQ(none.world.settings.time_step, WorldSettings().time_step);
  expect_near(std::get<UniformGravity>(none.world.settings.gravity).acceleration, {0, 0, 0});
}

TEST(Mjcf, GeomsOfTheWorldAreStaticBodies) {
  const LoadedWorld loaded =
      load(mujoco("<geom name='floor' type='plane' size='1 1 .1'/><geom type='box' size='1 2 3' pos='0 0 5'/>"
                  "<body name='wall' pos='7 0 0'><geom type='cylinder' size='1 2'/></body>"));
  EXPECT_THAT(names(loaded), ElementsAre("m::floor", "m::world_geom_1", "m::wall"));
  for (const BodyDescription& body : loaded.world.bodies) EXPECT_EQ(body.properties.motion, Motion::kStatic);
  only_geometry<Plane>(loaded, body_named(loaded, "m::floor"));
  expect_near(only_geometry<Box>(loaded, body_named(loaded, "m::world_geom_1")).size, {2, 4, 6});
  expect_near(place(loaded, "m::world_geom_1"), {0, 0, 5});
  const auto cylinder = only_geometry<Cylinder>(loaded, body_named(loaded, "m::wall"));
  EXPECT_DOUBLE_EQ(cylinder.radius, 1);
  EXPECT_DOUBLE_EQ(cylinder.length, 4);
}

TEST(Mjcf, CapsulesAndEllipsoidsKeepTheirSizes) {
  const LoadedWorld loaded = load(
      mujoco("<geom name='c' type='capsule' size='0.1 0.5'/><geom name='e' type='ellipsoid' size='1 2 3'/>"));
  const auto capsule = only_geometry<Capsule>(loaded, body_named(loaded, "m::c"));
  EXPECT_DOUBLE_EQ(capsule.radius, 0.1);
  EXPECT_DOUBLE_EQ(capsule.length, 1);
  expect_near(only_geometry<Ellipsoid>(loaded, body_named(loaded, "m::e")).radii, {1, 2, 3});
}

TEST(Mjcf, MeshesAreHullsWhereTheFileHasThem) {
  const Folder folder;
  folder.write("meshes/t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const LoadedWorld loaded = load(
      "<mujoco model='m'><compiler meshdir='meshes'/><asset><mesh name='t' file='t.obj' scale='2 2 "
      "2'/></asset>"
      "<worldbody><body name='b' pos='3 0 0'><freejoint/><geom type='mesh' "
      "mesh='t'/></body></worldbody></mujoco>",
      folder);
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::b"));
  const auto& hull = std::get<ConvexHull>(shape.parts.front().geometry);
  double farthest = 0;
  for (const Vector3d& point : hull.points)
    farthest = std::max(farthest, (shape.parts.front().pose * point - Vector3d(2, 0, 0)).norm());
  EXPECT_THAT(hull.points, SizeIs(4));
  EXPECT_NEAR(farthest, std::sqrt(8.0), 1e-6);  // its points are where the file has them
}

TEST(Mjcf, HeightFieldsKeepTheirHeights) {
  const Folder folder;
  std::string data;
  const auto put = [&](const auto& value) {
    data.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(2);
  put(3);
  for (const float height : {0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 4.0F}) put(height);
  folder.write("h.bin", data);
  const LoadedWorld loaded = load(
      "<mujoco model='m'><asset><hfield name='h' file='h.bin' size='2 1 8 1'/></asset><worldbody>"
      "<geom name='g' type='hfield' hfield='h'/></worldbody></mujoco>",
      folder);
  const auto field = only_geometry<HeightField>(loaded, body_named(loaded, "m::g"));
  EXPECT_EQ(field.columns, 3u);
  EXPECT_EQ(field.rows, 2u);
  EXPECT_DOUBLE_EQ(field.spacing.x(), 2);
  EXPECT_DOUBLE_EQ(field.spacing.y(), 2);
  EXPECT_THAT(field.heights, ElementsAre(0, 2, 4, 6, 8, 8));
}

TEST(Mjcf, MocapBodiesAreKinematic) {
  const LoadedWorld loaded = load(mujoco("<body name='b' mocap='true' pos='0 0 1'><geom size='1'/></body>"));
  EXPECT_EQ(body_named(loaded, "m::b").properties.motion, Motion::kKinematic);
  expect_near(place(loaded, "m::b"), {0, 0, 1});
}

TEST(Mjcf, BodiesWithoutJointsArePartsOfThoseAroundThem) {
  const LoadedWorld loaded =
      load(mujoco(moving("a", absl::StrCat("<freejoint/><body name='b' pos='1 0 0'>", kBallGeom,
                                           "<site name='s' pos='0 0 2'/></body>"))));
  EXPECT_THAT(names(loaded), ElementsAre("m::a"));
  const BodyDescription& body = body_named(loaded, "m::a");
  EXPECT_DOUBLE_EQ(body.properties.mass, 2);
  expect_near(Vector3d(body.properties.centre.data()), {0.5, 0, 0});
  EXPECT_THAT(shape_of(loaded, body).parts, SizeIs(2));
  ASSERT_THAT(loaded.world.frames, SizeIs(2));
  EXPECT_EQ(loaded.world.frames[0].name, "m::b");
  expect_near(loaded.world.frames[0].pose.position, {1, 0, 0});
  EXPECT_EQ(loaded.world.frames[1].name, "m::s");
  expect_near(loaded.world.frames[1].pose.position, {1, 0, 2});
}

TEST(Mjcf, FramesOfNewerFilesArePartsOfTheirBody) {
  const LoadedWorld loaded = load(
      mujoco(absl::StrCat("<body name='a'><freejoint/>", kBallGeom, "<frame pos='1 0 0'><frame pos='0 1 0'>",
                          kBallGeom, "</frame></frame></body>")));
  EXPECT_THAT(names(loaded), ElementsAre("m::a"));
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::a"));
  ASSERT_THAT(shape.parts, SizeIs(2));
  expect_near(shape.parts[1].pose.position, {1, 1, 0});
}

TEST(Mjcf, HingesAreRevoluteJointsWithAllThatTheyHave) {
  const LoadedWorld loaded = load(hinged(
      "axis='0 1 0' range='-30 60' damping='2' frictionloss='3' stiffness='4' springref='90' armature='1'"));
  const JointDescription& joint = joint_named(loaded, "m::j");
  EXPECT_EQ(joint.properties.type, JointType::kRevolute);
  EXPECT_EQ(joint.properties.parent.value, 0u);
  const JointAxis& axis = joint.properties.axes[0];
  EXPECT_NEAR(axis.lower, -pi / 6, 1e-12);
  EXPECT_NEAR(axis.upper, pi / 3, 1e-12);
  EXPECT_DOUBLE_EQ(axis.damping, 2);
  EXPECT_DOUBLE_EQ(axis.friction, 3);
  EXPECT_DOUBLE_EQ(axis.spring_stiffness, 4);
  EXPECT_NEAR(axis.spring_reference, pi / 2, 1e-12);
  EXPECT_DOUBLE_EQ(axis.armature, 1);
}

TEST(Mjcf, ARangeIsALimitUnlessTheFileSaysSomethingElse) {
  const auto upper = [](const std::string& of_joint, const std::string& compiler) {
    const LoadedWorld loaded = load(
        absl::StrCat("<mujoco model='m'>", compiler, "<worldbody>",
                     moving("b", absl::StrCat("<joint name='j' ", of_joint, "/>")), "</worldbody></mujoco>"));
    return joint_named(loaded, "m::j").properties.axes[0].upper;
  };
  EXPECT_NEAR(upper("range='-90 90'", ""), pi / 2, 1e-12);
  EXPECT_EQ(upper("range='-90 90' limited='false'", ""), kUnbounded);
  EXPECT_DOUBLE_EQ(upper("range='-1 1.5'", "<compiler angle='radian'/>"), 1.5);
}

TEST(Mjcf, SlidesAndBallsAreWhatTheyAre) {
  const LoadedWorld loaded =
      load(mujoco(moving("a", "<joint name='s' type='slide' axis='1 0 0' range='-1 2'/>") +
                  moving("b", "<joint name='k' type='ball' range='0 40'/>", "3 0 0")));
  EXPECT_EQ(joint_named(loaded, "m::s").properties.type, JointType::kPrismatic);
  EXPECT_DOUBLE_EQ(joint_named(loaded, "m::s").properties.axes[0].upper, 2);
  EXPECT_EQ(joint_named(loaded, "m::k").properties.type, JointType::kBall);
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("'range' of a ball joint, not simulated")));
}

TEST(Mjcf, TwoHingesAtRightAnglesAreUniversal) {
  const LoadedWorld loaded = load(
      mujoco(moving("b", "<joint name='x' axis='1 0 0'/><joint name='y' axis='0 1 0' range='-10 10'/>")));
  ASSERT_THAT(loaded.world.joints, SizeIs(1));
  EXPECT_EQ(loaded.world.joints[0].name, "m::x_y");
  EXPECT_EQ(loaded.world.joints[0].properties.type, JointType::kUniversal);
  EXPECT_NEAR(loaded.world.joints[0].properties.axes[1].upper, pi / 18, 1e-12);
  EXPECT_THAT(names(loaded), ElementsAre("m::b"));
}

TEST(Mjcf, OtherJointsOfABodyHaveLinksBetweenThem) {
  const LoadedWorld loaded = load(
      mujoco(moving("b",
                    "<joint name='x' type='slide' axis='1 0 0'/><joint name='z' type='slide' axis='0 0 1'/>"
                    "<joint name='y' axis='0 1 0'/>",
                    "0 0 1")));
  EXPECT_THAT(names(loaded), ElementsAre("m::b_link_1", "m::b_link_2", "m::b"));
  ASSERT_THAT(loaded.world.joints, SizeIs(3));
  EXPECT_EQ(loaded.world.joints[2].properties.parent.value, 2u);
  double mass = 0;
  for (const BodyDescription& body : loaded.world.bodies) mass += body.properties.mass;
  EXPECT_NEAR(mass, 1, 1e-12);
  EXPECT_NEAR(body_named(loaded, "m::b_link_1").properties.mass, 0.01, 1e-12);
  expect_near(place(loaded, "m::b_link_1"), {0, 0, 1});
}

JointDrive drive_of(const std::string& actuator, const std::string& of_joint = "") {
  return joint_named(load(hinged(of_joint, absl::StrCat("<actuator>", actuator, "</actuator>"))), "m::j")
      .drives[0];
}

TEST(MjcfActuators, ThatHoldAPositionAreServos) {
  const JointDrive plain = drive_of("<position joint='j' kp='50'/>");
  EXPECT_EQ(plain.mode, DriveMode::kServo);
  EXPECT_DOUBLE_EQ(plain.stiffness, 50);
  EXPECT_DOUBLE_EQ(plain.damping, 0);
  EXPECT_DOUBLE_EQ(plain.target, 0);
  const JointDrive damped = drive_of("<position joint='j' kp='50' kv='3'/>");
  EXPECT_DOUBLE_EQ(damped.stiffness, 50);
  EXPECT_DOUBLE_EQ(damped.damping, 3);
  const JointDrive geared = drive_of("<position joint='j' kp='50' gear='2'/>");
  EXPECT_DOUBLE_EQ(geared.stiffness, 200);
  // Control 0 of a range of 0.2 to 1 is 0.2.
  EXPECT_DOUBLE_EQ(drive_of("<position joint='j' kp='50' ctrlrange='0.2 1'/>").target, 0.2);
}

TEST(MjcfActuators, ARatioOfDampingIsThatOfTheInertiaAtTheJoint) {
  // m l^2 + 2/5 m r^2 = 1.004 kg m^2.
  const LoadedWorld loaded =
      load(mujoco("<body name='b'><joint name='j' axis='0 1 0'/><geom type='sphere' size='0.1' mass='1' "
                  "pos='1 0 0'/></body>",
                  "<actuator><position joint='j' kp='100' dampratio='1'/></actuator>"));
  EXPECT_NEAR(joint_named(loaded, "m::j").drives[0].damping, 2 * std::sqrt(100 * 1.004), 1e-9);
}

TEST(MjcfActuators, ThatHoldAVelocityAreServosWithoutStiffness) {
  const JointDrive drive = drive_of("<velocity joint='j' kv='7'/>");
  EXPECT_EQ(drive.mode, DriveMode::kServo);
  EXPECT_DOUBLE_EQ(drive.stiffness, 0);
  EXPECT_DOUBLE_EQ(drive.damping, 7);
}

TEST(MjcfActuators, MotorsApplyEffortsUpToTheirRange) {
  const LoadedWorld loaded =
      load(hinged("", "<actuator><motor joint='j' gear='5' ctrlrange='-1 2'/></actuator>"));
  const JointDescription& joint = joint_named(loaded, "m::j");
  EXPECT_EQ(joint.drives[0].mode, DriveMode::kEffort);
  EXPECT_DOUBLE_EQ(joint.properties.axes[0].effort_max, 10);
}

TEST(MjcfActuators, OfOneJointAddUp) {
  const JointDrive drive = drive_of("<position joint='j' kp='50'/><velocity joint='j' kv='7'/>");
  EXPECT_DOUBLE_EQ(drive.stiffness, 50);
  EXPECT_DOUBLE_EQ(drive.damping, 7);
}

TEST(MjcfActuators, AreBoundedByTheForcesOfTheJointInNewerFiles) {
  const LoadedWorld loaded = load(
      "<mujoco model='m'><default><default class='a'><joint actuatorfrcrange='-8 8'/></default></default>"
      "<worldbody><body name='b' childclass='a'><joint name='j'/><geom size='1'/></body></worldbody>"
      "<actuator><motor joint='j'/></actuator></mujoco>");
  EXPECT_DOUBLE_EQ(joint_named(loaded, "m::j").properties.axes[0].effort_max, 8);
}

TEST(MjcfActuators, WithoutACounterpartAreNamed) {
  const LoadedWorld loaded = load(hinged(
      "",
      "<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon><actuator><motor tendon='t'/>"
      "<muscle joint='j' lengthrange='0.1 1'/></actuator>"));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("actuator of a tendon, not simulated")));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("muscle, or whose gain changes, not simulated")));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("<tendon>, not simulated")));
}

TEST(Mjcf, AKeyframeIsTheStart) {
  constexpr char kKeys[] =
      "<keyframe><key name='other' qpos='1'/><key name='home' qpos='0.5' qvel='2' ctrl='0.25'/></keyframe>"
      "<actuator><position joint='j' kp='10'/></actuator>";
  const LoadedWorld loaded = load(hinged("axis='0 0 1' pos='-1 0 0'", kKeys));
  expect_near(place(loaded, "m::b"), {std::cos(0.5) - 1, std::sin(0.5), 0});
  expect_near(body_named(loaded, "m::b").angular_velocity, {0, 0, 2});
  EXPECT_DOUBLE_EQ(joint_named(loaded, "m::j").drives[0].target, 0.25);
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("<key> 'home': the world begins with it")));
  // Of several without a home, none.
  const LoadedWorld none = load(hinged("", "<keyframe><key qpos='1'/><key qpos='2'/></keyframe>"));
  EXPECT_LT(body_named(none, "m::b").pose.orientation.angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
}

TEST(Mjcf, NumbersOfAKeyframeMayBeOnSeveralLines) {
  const LoadedWorld loaded = load(
      mujoco(moving("b", "<freejoint/>"), "<keyframe><key qpos='\n  1 2  3\n\t1 0 0 0\n  '/></keyframe>"));
  expect_near(place(loaded, "m::b"), {1, 2, 3});
}

TEST(Mjcf, EqualitiesAreJointsAndFollowers) {
  const LoadedWorld loaded = load(mujoco(
      moving("a", "<joint name='j' axis='0 1 0'/>") + moving("b", "<joint name='k' axis='0 1 0'/>", "0 1 0") +
          moving("c", "<freejoint/>", "0 2 0") + moving("d", "<freejoint/>", "0 3 0"),
      "<equality><joint joint1='k' joint2='j' polycoef='0.1 2 0 0 0'/>"
      "<connect name='ball' body1='c' body2='d' anchor='0 0.5 0'/><weld name='fix' body1='c' body2='d'/>"
      "<weld name='held' body1='d'/></equality>"));
  const AxisMimic& mimic = joint_named(loaded, "m::k").properties.axes[0].mimic;
  EXPECT_EQ(mimic.leader.value, 1u);
  EXPECT_DOUBLE_EQ(mimic.multiplier, 2);
  EXPECT_DOUBLE_EQ(mimic.offset, 0.1);
  const JointProperties& ball = joint_named(loaded, "m::ball").properties;
  EXPECT_EQ(ball.type, JointType::kBall);
  expect_near(ball.in_parent.position, {0, 0.5, 0});
  expect_near(ball.in_child.position, {0, -0.5, 0});
  const JointProperties& fixed = joint_named(loaded, "m::fix").properties;
  EXPECT_EQ(fixed.type, JointType::kFixed);
  expect_near(fixed.in_parent.position - fixed.in_child.position, {0, 1, 0});
  const JointProperties& held = joint_named(loaded, "m::held").properties;
  EXPECT_EQ(held.parent.value, 0u);
  EXPECT_EQ(held.child.value, 4u);
}

TEST(Mjcf, FrictionIsThatOfAPointAPatchAndOfRolling) {
  const LoadedWorld loaded =
      load(mujoco("<geom name='a' size='1' friction='0.7 0.02 0.003' condim='6'/><geom name='b' size='1' "
                  "friction='0.6'/>"));
  const BodyProperties& patch = body_named(loaded, "m::a").properties;
  EXPECT_DOUBLE_EQ(patch.friction, 0.7);
  ASSERT_TRUE(patch.surface.has_value());
  EXPECT_NEAR(3 * pi / 16 * patch.surface->torsional_friction * patch.surface->patch_radius, 0.02, 1e-12);
  EXPECT_DOUBLE_EQ(patch.surface->rolling_friction, 0.003);
  EXPECT_FALSE(body_named(loaded, "m::b").properties.surface.has_value());
}

// Whether bits let two bodies of one geom each collide.
bool bits_match(const LoadedWorld& loaded, const std::string& a, const std::string& b) {
  const BodyProperties& first = body_named(loaded, a).properties;
  const BodyProperties& second = body_named(loaded, b).properties;
  return (first.category & second.mask) != 0 && (second.category & first.mask) != 0;
}

TEST(Mjcf, LinksCollideUnlessAJointIsBetweenThemOrTheFileExcludesThem) {
  const std::string last = moving("c", "<joint name='k' axis='0 1 0'/>");
  const std::string arm =
      absl::StrCat("<body name='base'>", kBallGeom, "<body name='a'><joint name='i'/>", kBallGeom,
                   "<body name='b'><joint name='j'/>", kBallGeom, last, "</body></body></body>");
  const LoadedWorld loaded = load(mujoco(arm));
  EXPECT_TRUE(joint_named(loaded, "m::i").properties.bodies_collide);  // the base never moves
  EXPECT_FALSE(joint_named(loaded, "m::j").properties.bodies_collide);
  EXPECT_TRUE(bits_match(loaded, "m::base", "m::a"));
  EXPECT_TRUE(bits_match(loaded, "m::a", "m::c"));
  const LoadedWorld apart =
      load(mujoco(arm, "<contact><exclude body1='base' body2='a'/><exclude body1='a' body2='c'/></contact>"));
  EXPECT_FALSE(bits_match(apart, "m::base", "m::a"));
  EXPECT_FALSE(bits_match(apart, "m::a", "m::c"));
  EXPECT_TRUE(bits_match(apart, "m::base", "m::c"));
}

TEST(Mjcf, BodiesWithLinksBetweenTheirJointsDoNotHitTheirParent) {
  const LoadedWorld loaded = load(mujoco(moving(
      "a", "<freejoint/>" +
               moving("b", "<joint name='x' axis='1 0 0'/><joint name='z' axis='0 0 1' pos='0 0 1'/>"))));
  EXPECT_THAT(names(loaded), ElementsAre("m::a", "m::b_link_1", "m::b"));
  EXPECT_FALSE(bits_match(loaded, "m::a", "m::b"));
  EXPECT_EQ(body_named(loaded, "m::b_link_1").properties.category, 0u);
}

TEST(Mjcf, SensorsArePrograms) {
  const LoadedWorld loaded =
      load(mujoco(moving("b", "<joint name='j'/><site name='s' pos='1 2 3'/>"),
                  "<sensor><accelerometer site='s' noise='0.1'/><gyro site='s' noise='0.2'/><rangefinder "
                  "site='s' cutoff='5'/>"
                  "<force site='s'/><torque site='s'/><touch site='s'/><jointpos joint='j'/></sensor>"));
  const std::vector<ProgramRecord>& programs = body_named(loaded, "m::b").programs;
  ASSERT_THAT(programs, SizeIs(4));
  EXPECT_EQ(programs[0].kind, "imu");
  EXPECT_EQ(programs[0].name, "s");
  EXPECT_DOUBLE_EQ(number_of(programs[0], "y"), 2);
  EXPECT_DOUBLE_EQ(number_of(programs[0], "noise"), 0.1);
  EXPECT_DOUBLE_EQ(number_of(programs[0], "turn_noise"), 0.2);
  EXPECT_EQ(programs[1].kind, "ranger");
  EXPECT_DOUBLE_EQ(number_of(programs[1], "most"), 5);
  EXPECT_NEAR(number_of(programs[1], "pitch"), -pi / 2, 1e-12);  // it looks along z
  EXPECT_EQ(programs[2].kind, "load");
  EXPECT_DOUBLE_EQ(number_of(programs[2], "joint"), 1);
  EXPECT_EQ(programs[3].kind, "touch");
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("sensor jointpos, skipped")));
}

TEST(Mjcf, WhatIsOnlySeenOrUnknownIsNamed) {
  const LoadedWorld loaded = load(mujoco(
      "<light/><camera name='c'/><body><freejoint/><geom size='1' wings='2'/></body>",
      "<visual/><option integrator='implicitfast'/><asset><texture name='t' file='none.png' type='2d'/>"
      "<material name='k' texture='t'/></asset>"));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("1 x <light> skipped")));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("1 x <camera> skipped")));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("1 x <texture> skipped")));
  EXPECT_THAT(loaded.notices,
              Contains(HasSubstr("'wings' of <geom>, which MuJoCo 2.2 does not know, skipped")));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("'integrator' of <option>")));
}

TEST(Mjcf, IncludesAreRead) {
  const Folder folder;
  folder.write("parts/leg.xml",
               "<mujocoinclude><body name='leg'><joint name='j'/><geom size='1'/></body></mujocoinclude>");
  const LoadedWorld loaded = load(mujoco("<include file='parts/leg.xml'/>"), folder);
  EXPECT_THAT(names(loaded), ElementsAre("m::leg"));
}

TEST(Mjcf, LooksAreWhatMujocoShows) {
  const Folder folder;
  folder.write("m.xml",
               mujoco("<body name='b'><freejoint/><geom size='1' rgba='1 0 0 1'/><geom size='2' group='3'/>"
                      "</body>"));
  const absl::StatusOr<Looks> looks = load_looks(static_cast<const std::filesystem::path&>(folder) / "m.xml");
  ASSERT_TRUE(looks.ok()) << looks.status();
  const Look& look = *looks->bodies.at("m::b");
  ASSERT_THAT(look.shape.parts, SizeIs(1));
  EXPECT_EQ(look.colours.front(), 0xff0000u);
}

}  // namespace
}  // namespace tessera::mjcf
