// Faults of files that others load: mended, counted, and refused where the caller is strict.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "lpss/model/limits.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string inertial(const std::string& mass, const std::string& moments) {
  return absl::StrCat("<inertial><mass>", mass, "</mass><inertia>", moments, "</inertia></inertial>");
}

std::string moments(double xx, double yy, double zz) {
  return absl::StrCat("<ixx>", xx, "</ixx><iyy>", yy, "</iyy><izz>", zz, "</izz>");
}

// A robot of two links, 'base' and 'tip', and a joint 'j' between them.
std::string robot(const std::string& base, const std::string& tip, const std::string& more = "",
                  const std::string& type = "continuous") {
  return absl::StrCat("<robot name='r'>\n<link name='base'>", base, "</link>\n<link name='tip'>", tip,
                      "</link>\n<joint name='j' type='", type,
                      "'><parent link='base'/><child link='tip'/><origin xyz='0 0 1'/></joint>", more,
                      "</robot>");
}

std::string urdf_inertial(double mass, double moment) {
  return absl::StrCat("<inertial><mass value='", mass, "'/><inertia ixx='", moment, "' ixy='0' ixz='0' iyy='",
                      moment, "' iyz='0' izz='", moment, "'/></inertial>");
}

const char kUrdfBox[] = "<collision><geometry><box size='1 1 1'/></geometry></collision>";

// What is sound: the file loads, which validates it, and says one thing.
LoadedWorld repaired(const std::string& xml, const std::string& what,
                     const std::filesystem::path& folder = "/") {
  LoadedWorld loaded = load(xml, folder);
  EXPECT_THAT(loaded.repairs, ElementsAre(HasSubstr(what)));
  const auto strict = load_world_string(xml, folder, Faults::kRefuse);
  EXPECT_EQ(strict.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(strict.status().message()), HasSubstr(what));
  return loaded;
}

LoadedWorld with_inertia(const std::string& mass, const std::string& of_inertia, const std::string& what) {
  return repaired(world(model("m", "", inertial(mass, of_inertia) + kUnitBox)), what);
}

TEST(Repairs, NothingIsSaidOfASoundFile) {
  const std::string sound = world(model("m", "", inertial("2", moments(1, 2, 3)) + kUnitBox));
  EXPECT_THAT(load(sound).repairs, IsEmpty());
  EXPECT_TRUE(load_world_string(sound, "/", Faults::kRefuse).ok());
}

TEST(Repairs, TriangleInequalityRaisesTheSmallerMoments) {
  const LoadedWorld loaded =
      with_inertia("2", moments(1, 1, 5), "1 x moment of inertia larger than the other two");
  const auto& inertia = body_named(loaded, "m::l").properties.inertia;
  EXPECT_NEAR(inertia[0], 2.5, 1e-2);
  EXPECT_NEAR(inertia[1], 2.5, 1e-2);
  EXPECT_NEAR(inertia[2], 5, 1e-9);
  EXPECT_THAT(loaded.repairs, ElementsAre(HasSubstr("<inertial> of <link name='l'>")));
}

TEST(Repairs, AxesOfAFullTensorStay) {
  // The principal moments are 0.5, 1.5 and 8, about axes turned by an eighth of a turn about z.
  const LoadedWorld loaded = with_inertia("2", moments(1, 1, 8) + "<ixy>0.5</ixy>", "triangle inequality");
  const BodyProperties& p = body_named(loaded, "m::l").properties;
  const Eigen::Matrix3d axes = centre_frame(p).orientation.toRotationMatrix();
  const Eigen::Matrix3d tensor =
      axes * Eigen::Vector3d(p.inertia[0], p.inertia[1], p.inertia[2]).asDiagonal() * axes.transpose();
  EXPECT_NEAR(tensor(0, 1), 0.5, 1e-9);
  EXPECT_NEAR(tensor(0, 0), 4, 1e-2);
  EXPECT_NEAR(tensor(2, 2), 8, 1e-9);
}

TEST(Repairs, AMomentThatIsNothingBesideTheOthers) {
  const LoadedWorld loaded = with_inertia("6.5", moments(2e-18, 0.215, 0.215), "too small beside the others");
  const auto& inertia = body_named(loaded, "m::l").properties.inertia;
  EXPECT_GT(inertia[0], 1e-4);
  EXPECT_LT(inertia[0], 1e-3);
  EXPECT_NEAR(inertia[1], 0.215, 1e-3);
}

TEST(Repairs, OneMomentOfZeroOrLess) {
  for (double moment : {0.0, -3.0}) {
    const LoadedWorld loaded = with_inertia("1", moments(moment, 2, 2), "moment of inertia of 0 or less");
    EXPECT_GT(body_named(loaded, "m::l").properties.inertia[0], 0);
  }
}

TEST(Repairs, NoMomentAtAllIsABallOfWater) {
  const LoadedWorld loaded = with_inertia("1000", moments(0, 0, 0), "ball of water");
  // 1 m^3: 2/5 m r^2.
  EXPECT_NEAR(body_named(loaded, "m::l").properties.inertia[2], 400 * std::pow(3 / (4 * M_PI), 2 / 3.0),
              1e-3);
}

TEST(Repairs, MomentsThatAreRoundingErrorsAreABallOfWater) {
  const LoadedWorld loaded = with_inertia("0.746", moments(2.7e-20, 5.4e-20, 1.4e-20), "0 or next to it");
  EXPECT_NEAR(body_named(loaded, "m::l").properties.inertia[0], 9.446e-4, 1e-7);
}

TEST(Repairs, TinyMassesKeepTheirProportions) {
  const LoadedWorld loaded = with_inertia("1e-9", moments(1e-12, 1e-12, 1e-12), "mass below 1e-06 kg");
  EXPECT_EQ(body_named(loaded, "m::l").properties.mass, kMassMin);
  EXPECT_NEAR(body_named(loaded, "m::l").properties.inertia[0], 1e-9, 1e-15);
}

TEST(Repairs, MasslessLinksOfSdf) {
  const LoadedWorld loaded =
      repaired(world("<model name='m'><link name='a'>" + inertial("50", moments(3, 4, 5)) + kUnitBox +
                     "</link><link name='b'>" + inertial("0", moments(1, 1, 1)) + kUnitBox +
                     "</link><joint name='j' type='ball'><parent>a</parent><child>b</child></joint></model>"),
               "1 x link without mass, given a hundredth");
  EXPECT_DOUBLE_EQ(body_named(loaded, "m::b").properties.mass, 0.5);
  EXPECT_DOUBLE_EQ(body_named(loaded, "m::b").properties.inertia[0], 0.04);
}

TEST(Repairs, MasslessLinkAlone) {
  const LoadedWorld loaded =
      repaired(world(model("m", "", inertial("0", moments(0, 0, 0)) + kUnitBox)), "without mass");
  EXPECT_EQ(body_named(loaded, "m::l").properties.mass, 1);
}

TEST(Repairs, StaticLinksNeedNoMass) {
  EXPECT_THAT(
      load(world(model("m", "<static>1</static>", inertial("0", moments(0, 0, 9)) + kUnitBox))).repairs,
      IsEmpty());
}

TEST(Repairs, MasslessUrdfLinkBetweenOthersMoves) {
  const LoadedWorld loaded = repaired(
      robot(urdf_inertial(20, 2) + kUrdfBox, "",
            "<joint name='k' type='continuous'><parent link='tip'/><child link='end'/></joint><link "
            "name='end'>" +
                urdf_inertial(1, 1) + kUrdfBox + "</link>"),
      "1 x link without mass, given a hundredth of that of the nearest link: <string>:3: <link name='tip'>");
  EXPECT_THAT(names(loaded), ElementsAre("r::base", "r::tip", "r::end"));
  EXPECT_EQ(loaded.world.joints.size(), 2u);
  EXPECT_DOUBLE_EQ(body_named(loaded, "r::tip").properties.mass, 0.2);
  EXPECT_DOUBLE_EQ(body_named(loaded, "r::tip").properties.inertia[1], 0.02);
}

TEST(Repairs, MasslessUrdfRootIsFixedToTheWorld) {
  const LoadedWorld loaded = repaired(robot(kUrdfBox, urdf_inertial(1, 1) + kUrdfBox),
                                      "1 x link without mass that nothing holds, fixed to the world");
  EXPECT_EQ(body_named(loaded, "r::base").properties.motion, Motion::kStatic);
  EXPECT_EQ(body_named(loaded, "r::tip").properties.motion, Motion::kDynamic);
  EXPECT_EQ(loaded.world.joints.size(), 1u);
}

TEST(Repairs, RootOfMassZeroIsNoFault) {
  const LoadedWorld loaded = load(robot("<inertial><mass value='0'/></inertial>", urdf_inertial(1, 1)));
  EXPECT_THAT(loaded.repairs, IsEmpty());
  EXPECT_THAT(loaded.notices, Contains("1 x link of mass 0 that nothing holds, fixed to the world"));
}

TEST(Repairs, MasslessUrdfLinkFixedToTheWorldNeedsNone) {
  const LoadedWorld loaded =
      load(robot("", urdf_inertial(1, 1) + kUrdfBox,
                 "<link name='world'/><joint name='w' type='fixed'><parent link='world'/>"
                 "<child link='base'/></joint>"));
  EXPECT_THAT(loaded.repairs, IsEmpty());
  EXPECT_EQ(loaded.world.joints.size(), 1u);
}

TEST(Repairs, LinksOnFixedJointsArePartOfTheirParents) {
  const LoadedWorld loaded = load(robot("", urdf_inertial(3, 1) + kUrdfBox, "", "fixed"));
  EXPECT_THAT(loaded.repairs, IsEmpty());
  EXPECT_THAT(loaded.notices, Contains("1 x link on a fixed joint, part of its parent's body"));
  EXPECT_EQ(body_named(loaded, "r::base").properties.mass, 3);
}

TEST(Repairs, RobotWithoutAnyMass) {
  const LoadedWorld loaded = load(robot(kUrdfBox, kUrdfBox));
  EXPECT_EQ(body_named(loaded, "r::tip").properties.mass, 1);
  EXPECT_EQ(loaded.repairs.size(), 2u);
}

TEST(Repairs, TinyUrdfMassesAndMissingNumbers) {
  const LoadedWorld tiny = load(robot(urdf_inertial(1, 1) + kUrdfBox, urdf_inertial(1e-9, 1e-9) + kUrdfBox));
  EXPECT_EQ(body_named(tiny, "r::tip").properties.mass, 2e-6);
  EXPECT_THAT(tiny.repairs, ElementsAre(HasSubstr("mass below 2e-06 kg")));
  const LoadedWorld bare =
      load(robot("<inertial><mass value='2'/></inertial>" + std::string(kUrdfBox), urdf_inertial(1, 1)));
  EXPECT_THAT(bare.repairs, ElementsAre(HasSubstr("inertia that is not complete"),
                                        HasSubstr("ball of water of the same mass")));
}

TEST(Repairs, FrictionBelowZeroIsInfinite) {
  const std::string surface =
      "<surface><friction><ode><mu>-1</mu><mu2>-1</mu2></ode></friction></surface></collision>";
  std::string link = inertial("1", moments(1, 1, 1)) + kUnitBox;
  link.replace(link.find("</collision>"), 12, surface);
  const LoadedWorld loaded = repaired(world(model("m", "", link)), "2 x friction below 0, taken as infinite");
  EXPECT_EQ(body_named(loaded, "m::l").properties.friction, 1e6);
}

TEST(Repairs, SpheresThatStandForPointsGetASize) {
  const LoadedWorld loaded =
      repaired(world(model("m", "", collision("<sphere><radius>1e-7</radius></sphere>"))),
               "1 x size below 0.0001 m, raised to it");
  EXPECT_EQ(only_geometry<Sphere>(loaded, body_named(loaded, "m::l")).radius, 1e-4);
}

TEST(Repairs, JointNamedWorld) {
  const LoadedWorld loaded =
      repaired(world("<model name='m'><link name='a'/><joint name='world' type='ball'><parent>world</parent>"
                     "<child>a</child></joint></model>"),
               "1 x joint named world, which SDF reserves");
  ASSERT_EQ(loaded.world.joints.size(), 1u);
  EXPECT_EQ(loaded.world.joints[0].name, "m::world_joint");
}

TEST(Repairs, CollisionsOfOneName) {
  const std::string second = collision("<sphere><radius>1</radius></sphere>");
  const LoadedWorld loaded = repaired(world(model("m", "", kUnitBox + second + second)),
                                      "2 x collision with the name of another one of its link");
  EXPECT_EQ(shape_of(loaded, body_named(loaded, "m::l")).parts.size(), 3u);
}

// As in the grippers of PyBullet.
TEST(Repairs, LinkNamedWorld) {
  const auto gripper = [](const std::string& of_link) {
    return world("<model name='m'><link name='world'>" + of_link + "</link><link name='a'>" + kUnitBox +
                 "</link><joint name='j' type='ball'><parent>world</parent><child>a</child></joint></model>");
  };
  const LoadedWorld fixed = repaired(gripper(""), "1 x link named world with no mass and no shape");
  EXPECT_THAT(names(fixed), ElementsAre("m::a"));
  EXPECT_EQ(fixed.world.joints.at(0).properties.parent, BodyId{});
  const LoadedWorld moves = repaired(gripper(kUnitBox), "1 x link named world, which SDF reserves");
  EXPECT_THAT(names(moves), ElementsAre("m::world_link", "m::a"));
  EXPECT_EQ(moves.world.joints.at(0).properties.parent, BodyId{1});
}

// Files up to SDF 1.2.
TEST(Repairs, GazeboAsTheRoot) {
  const LoadedWorld loaded = load("<gazebo version='1.2'><model name='m'><link name='l'>" +
                                  inertial("1", moments(1, 1, 1)) + kUnitBox + "</link></model></gazebo>");
  EXPECT_THAT(names(loaded), ElementsAre("m::l"));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("<gazebo> as the root")));
}

TEST(Repairs, JointWithTheNameOfALink) {
  const LoadedWorld of_urdf = repaired(robot(urdf_inertial(1, 1) + kUrdfBox, urdf_inertial(1, 1) + kUrdfBox,
                                             "<joint name='end' type='continuous'><parent link='tip'/><child "
                                             "link='end'/></joint><link name='end'>" +
                                                 urdf_inertial(1, 1) + kUrdfBox + "</link>"),
                                       "1 x joint with the name of a link or frame");
  EXPECT_THAT(names(of_urdf), Contains("r::end"));
  EXPECT_EQ(of_urdf.world.joints[1].name, "r::end_joint");
  const LoadedWorld of_sdf = repaired(
      world("<model name='m'><link name='a'/><link name='b'/><joint name='b' type='ball'><parent>a</parent>"
            "<child>b</child></joint></model>"),
      "1 x joint with the name of a link or frame");
  EXPECT_EQ(of_sdf.world.joints[0].name, "m::b_joint");
}

TEST(Repairs, MaterialsDefinedTwice) {
  const std::string grey = "<material name='grey'><color rgba='1 1 1 1'/></material>";
  repaired(robot(urdf_inertial(1, 1) + kUrdfBox, urdf_inertial(1, 1), grey + grey),
           "1 x material that is defined twice");
}

TEST(Repairs, LimitsThatAreMissingOrCrossed) {
  const auto hinge = [](const std::string& limit) {
    return absl::StrCat("<robot name='r'><link name='a'>", urdf_inertial(1, 1), "</link><link name='b'>",
                        urdf_inertial(1, 1), "</link><joint name='j' type='revolute'><parent link='a'/>",
                        "<child link='b'/><axis xyz='1 0 0'/>", limit, "</joint></robot>");
  };
  const LoadedWorld crossed = repaired(hinge("<limit lower='1' upper='-0.5' effort='1' velocity='1'/>"),
                                       "1 x joint whose lower limit");
  EXPECT_EQ(crossed.world.joints[0].properties.axes[0].lower, -0.5);
  EXPECT_EQ(crossed.world.joints[0].properties.axes[0].upper, 1);
  const LoadedWorld none = repaired(hinge(""), "1 x joint without <limit>");
  EXPECT_EQ(none.world.joints[0].properties.axes[0].upper, kUnbounded);
  const LoadedWorld half = load(hinge("<limit lower='-1' upper='1'/>"));
  EXPECT_EQ(half.world.joints[0].properties.axes[0].lower, -1);
  EXPECT_EQ(half.world.joints[0].properties.axes[0].effort_max, kUnbounded);
  EXPECT_EQ(half.repairs.size(), 2u);
}

// Meshes.

const char kSquare[] = "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 2 3\nf 1 3 4\n";
const char kNeedle[] = "v 0 0 0\nv 0.1 0.1 0.1\nv 0.3 0.3 0.3\nf 1 2 3\n";

std::string mesh(const std::string& file) { return collision("<mesh><uri>" + file + "</uri></mesh>"); }

TEST(Repairs, FlatMeshOfABodyThatMovesGetsAThickness) {
  const Folder folder;
  folder.write("square.obj", kSquare);
  const LoadedWorld loaded =
      repaired(world(model("m", "", mesh("square.obj"))), "1 x mesh object that is flat", folder);
  const auto hull = only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(hull.points.size(), 8u);
  EXPECT_NEAR(slab_around(hull.points).thickness, 2 * kExtentMin, 1e-9);
}

TEST(Repairs, MeshesWithoutAreaAreLeftOut) {
  const Folder folder;
  folder.write("needle.obj", kNeedle);
  repaired(world(model("m", "",
                       mesh("needle.obj") + "<collision name='d'><geometry><box/></geometry></collision>")),
           "1 x mesh object whose points are all on a line", folder);
  repaired(world(model("m", "<static>1</static>", mesh("needle.obj"))),
           "1 x mesh whose triangles have no area", folder);
}

TEST(Repairs, CollisionsOfNoSizeAreLeftOut) {
  const LoadedWorld loaded =
      repaired(world(model("m", "",
                           collision("<box><size>0 0 0</size></box>") +
                               "<collision name='d'><geometry><box/></geometry></collision>")),
               "1 x collision of no size");
  EXPECT_EQ(shape_of(loaded, body_named(loaded, "m::l")).parts.size(), 1u);
}

TEST(Repairs, RobotWithoutName) {
  for (const char* name : {"", " name=''"}) {
    const LoadedWorld loaded = repaired(
        absl::StrCat("<robot", name, "><link name='a'>", urdf_inertial(1, 1), kUrdfBox, "</link></robot>"),
        "1 x robot without name");
    EXPECT_THAT(names(loaded), ElementsAre("robot::a"));
  }
}

// Unknown words.

TEST(Unknown, ElementsOfSdfWithTheNearestWord) {
  repaired(
      world(model("m", "", "<inertal><mass>3</mass></inertal>" + kUnitBox)),
      "1 x unknown element <inertal> in <link>, left out; the nearest known is <inertial>: <link name='l'>");
  repaired(world("<gravty>0 0 0</gravty>"), "<gravty> in <world>, left out; the nearest known is <gravity>");
  repaired(world("<physics type='x'><max_step>0.1</max_step></physics>"),
           "unknown element <max_step> in <physics>");
  repaired(world(model("m", "", "<xyzzy/>" + kUnitBox)),
           "unknown element <xyzzy> in <link>, left out: <link");
  // In files of an older version, too.
  repaired(world(model("m", "", "<inertal/>" + kUnitBox), "1.6"), "the nearest known is <inertial>");
}

TEST(Unknown, ElementsAndAttributesOfUrdf) {
  repaired(
      robot(urdf_inertial(1, 1) + "<colision/>", urdf_inertial(1, 1)),
      "<colision> in <link>, left out; the nearest known is <collision>: <string>:2: <colision> of <link "
      "name='base'>");
  repaired(robot(urdf_inertial(1, 1), urdf_inertial(1, 1),
                 "<joint name='k' type='continuous'><parent link='base'/><child link='c'/><dynamics "
                 "friction='2' dampng='1'/></joint>"
                 "<link name='c'>" +
                     urdf_inertial(1, 1) + "</link>"),
           "unknown attribute dampng of <dynamics>, left out; the nearest known is damping");
}

TEST(Unknown, ExtensionsAndNewerElementsAreNotSimulated) {
  const LoadedWorld loaded =
      load(world(model("m", "", "<drake:diff/><inertial><auto_inertia_params/></inertial>" + kUnitBox)));
  EXPECT_THAT(loaded.repairs, IsEmpty());
  EXPECT_THAT(loaded.notices, ElementsAre("1 x <drake:diff> of <link> not simulated",
                                          "1 x <inertial><auto_inertia_params> of <link> not simulated"));
}

// What is not simulated is named.

TEST(NotSimulated, SurfacesByTheirOwnNames) {
  const auto surface = [](const std::string& of_surface) {
    return load(world(model("m", "", collision("<box/>", "<surface>" + of_surface + "</surface>")))).notices;
  };
  EXPECT_THAT(surface("<friction><ode><mu>0.5</mu><mu2>0.7</mu2><fdir1>1 0 0</fdir1><slip1>0.1</slip1></ode>"
                      "<torsional><surface_radius>0.3</surface_radius></torsional></friction>"
                      "<contact><ode><kp>1e5</kp><kd>10</kd></ode></contact>"),
              ElementsAre("1 x <surface><contact><ode><kd> of <collision> not simulated",
                          "1 x <surface><contact><ode><kp> of <collision> not simulated",
                          "1 x <surface><friction><ode><slip1> of <collision> not simulated",
                          "1 x <surface><friction><torsional><surface_radius> of <collision> not simulated"));
  EXPECT_THAT(surface("<friction><ode><mu>0.5</mu><mu2>0.5</mu2><slip1>0</slip1></ode></friction>"),
              IsEmpty());
}

TEST(NotSimulated, PhysicsByItsOwnNames) {
  EXPECT_THAT(load(world("<physics type='ode'><max_step_size>0.01</max_step_size><real_time_factor>1"
                         "</real_time_factor></physics><wind/>"))
                  .notices,
              ElementsAre("1 x <physics><real_time_factor> skipped", "1 x <wind> skipped"));
}

TEST(NotSimulated, ExtensionsOfUrdfByTheirOwnNames) {
  const LoadedWorld loaded =
      load(robot(urdf_inertial(1, 1) + "<visual/>", urdf_inertial(1, 1),
                 "<gazebo reference='tip'><kp>1e6</kp><plugin/></gazebo><gazebo><mu1>0.2</mu1></gazebo>"
                 "<transmission/>"));
  EXPECT_THAT(loaded.notices,
              AllOf(Contains("1 x <gazebo><kp> not simulated"), Contains("1 x <gazebo><mu1> not simulated"),
                    Contains("1 x <visual> for the web UI alone"), Contains("1 x <plugin> skipped"),
                    Contains("1 x <transmission> not simulated")));
}

// Messages.

TEST(Messages, NameTheModelOfTheFile) {
  const auto bad = [](const std::string& body) {
    return std::string(load_world_string(world(body), "/").status().message());
  };
  for (const std::string& text :
       {bad("<model name='crane'><link name='l'/><link name='l'/></model>"),
        bad(model("crane", "", "<pose relative_to='nowhere'/>" + kUnitBox)), bad("<model name='crane'/>")}) {
    EXPECT_THAT(text, AllOf(HasSubstr("<model name='crane'>"), Not(HasSubstr("tessera:")),
                            Not(HasSubstr("[m]")), Not(HasSubstr("name='m'"))));
  }
}

TEST(Messages, NamesThatAreNotUtf8) {
  const auto loaded = load_world_string(world(model("h\xfcgel", "")), "/");
  EXPECT_EQ(loaded.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(loaded.status().message()),
              HasSubstr("body 'h\\xfcgel::l': the name must be UTF-8"));
  EXPECT_THAT(
      load(world("<plugin name='p' filename='h\xfc'/>" + model("m", "<plugin name='p' filename='h\xfc'/>")))
          .notices,
      Contains(HasSubstr("h\\xfc")));
}

}  // namespace
}  // namespace tessera
