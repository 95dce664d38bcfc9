// Robots of URDF keep their links, joints and collisions.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "worlds/loader/urdf_joints.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;

constexpr char kMass[] =
    "<inertial><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' "
    "izz='0.01'/></inertial>";
constexpr char kNoMass[] =
    "<inertial><mass value='0'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>";
constexpr char kBall[] = "<collision><geometry><sphere radius='0.1'/></geometry></collision>";

std::string link(const std::string& name, const std::string& of_link) {
  return absl::StrCat("<link name='", name, "'>", of_link, "</link>");
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& more = "") {
  return absl::StrCat("<joint name='", name, "' type='", type, "'><parent link='", parent, "'/><child link='",
                      child, "'/>", more, "</joint>");
}

std::string robot(const std::string& body) { return absl::StrCat("<robot name='r'>", body, "</robot>"); }

std::vector<std::string> frames(const LoadedWorld& loaded) {
  std::vector<std::string> result;
  for (const auto& frame : loaded.world.frames) result.push_back(frame.name);
  return result;
}

constexpr char kAxis[] = "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='10' velocity='1'/>";
const std::string kHand =
    link("base", absl::StrCat(kMass, kBall)) + link("mount", absl::StrCat(kNoMass, kBall)) +
    link("flange", "") + link("left", absl::StrCat(kMass, kBall)) +
    link("right", absl::StrCat(kMass, kBall)) +
    joint("f", "fixed", "base", "mount", "<origin xyz='0.2 0 0' rpy='0 0 1.5707963267948966'/>") +
    joint("g", "fixed", "mount", "flange", "<origin xyz='0 0 0.5' rpy='0.3 0.4 0.5'/>") +
    joint("l", "prismatic", "flange", "left",
          absl::StrCat("<origin xyz='0 0.1 0' rpy='0.1 0.2 0.3'/>", kAxis)) +
    joint("m", "prismatic", "flange", "right", absl::StrCat("<mimic joint='l'/>", kAxis));

Eigen::Quaterniond turn(double roll, double pitch, double yaw) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

// As those of a Panda, whose hand and flange have no mass in many files.
TEST(UrdfLinks, WithoutMassOnFixedJointsAreFramesWithAllThatHangsOnThem) {
  const LoadedWorld loaded = load(robot(kHand));
  EXPECT_THAT(names(loaded), ElementsAre("r::base", "r::left", "r::right"));
  EXPECT_THAT(frames(loaded), UnorderedElementsAre("r::mount", "r::flange"));
  EXPECT_THAT(loaded.world.joints, SizeIs(2));
  EXPECT_THAT(shape_of(loaded, body_named(loaded, "r::base")).parts, SizeIs(2));
  EXPECT_DOUBLE_EQ(body_named(loaded, "r::base").properties.mass, 1);
  EXPECT_THAT(loaded.repairs, IsEmpty());

  const Pose flange =
      Pose{{0.2, 0, 0}, turn(0, 0, std::numbers::pi / 2)} * Pose{{0, 0, 0.5}, turn(0.3, 0.4, 0.5)};
  const Pose left = flange * Pose{{0, 0.1, 0}, turn(0.1, 0.2, 0.3)};
  expect_near(place(loaded, "r::left"), left.position, 1e-9);
  expect_near(place(loaded, "r::right"), flange.position, 1e-9);
  EXPECT_LT(body_named(loaded, "r::left").pose.orientation.angularDistance(left.orientation), 1e-9);
  for (const JointDescription& one : loaded.world.joints)
    EXPECT_EQ(one.properties.parent, BodyId{1}) << one.name;
  EXPECT_TRUE(loaded.world.joints[1].properties.axes[0].mimic.is_set());
}

// A link that moves without a mass gets one, and what is fixed to it is a part of it, too.
TEST(UrdfLinks, WithoutMassOnALinkWithoutMass) {
  const LoadedWorld loaded =
      load(robot(link("base", absl::StrCat(kMass, kBall)) + link("arm", kBall) + link("mount", "") +
                 link("tool", absl::StrCat(kMass, kBall)) + joint("a", "continuous", "base", "arm") +
                 joint("f", "fixed", "arm", "mount", "<origin xyz='1 0 0'/>") +
                 joint("t", "continuous", "mount", "tool", "<origin xyz='1 0 0'/>")));
  EXPECT_THAT(names(loaded), ElementsAre("r::base", "r::arm", "r::tool"));
  EXPECT_THAT(loaded.world.joints, SizeIs(2));
  expect_near(place(loaded, "r::tool"), {2, 0, 0}, 1e-9);
}

// Straight up and down, roll and yaw turn about one axis. (libsdformat's angles have fewer digits there.)
TEST(UrdfLinks, OriginsThatPointStraightUp) {
  for (const double pitch : {0.5, -0.5}) {
    const std::string rpy =
        absl::StrCat("<origin xyz='0 0 1' rpy='0.7 ", pitch * std::numbers::pi, " 0.2'/>");
    const LoadedWorld loaded =
        load(robot(link("base", absl::StrCat(kMass, kBall)) + link("mount", "") +
                   link("arm", absl::StrCat(kMass, kBall)) + joint("f", "fixed", "base", "mount", rpy) +
                   joint("a", "continuous", "mount", "arm")));
    const Eigen::Quaterniond right = turn(0.7, pitch * std::numbers::pi, 0.2);
    EXPECT_LT(body_named(loaded, "r::arm").pose.orientation.angularDistance(right), 1e-5) << pitch;
  }
}

TEST(UrdfLinks, NamedWorldWithAShapeKeepIt) {
  const LoadedWorld loaded = load(robot(link("world", kBall) + link("arm", absl::StrCat(kMass, kBall)) +
                                        joint("a", "continuous", "world", "arm")));
  EXPECT_THAT(names(loaded), UnorderedElementsAre("r::world_link", "r::arm"));
  EXPECT_EQ(body_named(loaded, "r::world_link").properties.motion, Motion::kStatic);
  EXPECT_THAT(loaded.world.joints, SizeIs(1));
  EXPECT_THAT(loaded.repairs, ElementsAre(HasSubstr("link named world with a shape")));
}

// A car of Bullet's has four scales; libsdformat would leave out its chassis.
TEST(UrdfLinks, KeepMeshesWithOddScales) {
  const Folder folder;
  folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  for (const char* scale : {"2 2 2 1", "2"}) {
    const LoadedWorld loaded =
        load(robot(link("base", absl::StrCat(kMass, "<collision><geometry><mesh filename='a.obj' scale='",
                                             scale, "'/></geometry></collision>"))),
             folder);
    EXPECT_THAT(only_geometry<ConvexHull>(loaded, body_named(loaded, "r::base")).points,
                Contains(Eigen::Vector3d(0, 0, 2)));
    EXPECT_THAT(loaded.repairs, ElementsAre(HasSubstr("scale of a <mesh> that is not three numbers")));
  }
}

// Whatever libsdformat leaves out next is an error.
TEST(UrdfCensus, TellsWhatAModelLacks) {
  const auto before = xml::File::parse(robot(kHand), "r.urdf", "");
  const UrdfCensus census((*before)->root());
  const auto check = [&](const std::string& model) {
    return census.check((*xml::File::parse(model, "r", ""))->root());
  };
  const std::string whole =
      "<model><link name='base'><collision/><collision/></link><link name='left'><collision/></link>"
      "<link name='right'><collision/></link><frame name='mount'/><frame name='flange'/>";
  EXPECT_TRUE(check(whole + "<joint name='l'/><joint name='m'/></model>").ok());
  EXPECT_THAT(std::string(check(whole + "<joint name='l'/></model>").message()),
              AllOf(HasSubstr("r.urdf:1: <robot name='r'>: "), HasSubstr("lose 1 of 2 joints: m")));
  EXPECT_THAT(std::string(check("<model><link name='base'><collision/></link></model>").message()),
              AllOf(HasSubstr("4 of 5 links: mount, flange, left, right"), HasSubstr("2 of 2 joints: l, m"),
                    HasSubstr("3 of 4 collisions")));
}

}  // namespace
}  // namespace tessera
