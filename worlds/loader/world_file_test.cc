// What a world file says is what the world holds: settings, places, includes and what is left out.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <variant>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

// World settings.

TEST(Settings, DefaultsWithoutAny) {
  const WorldSettings settings = load(world("")).world.settings;
  EXPECT_EQ(settings.time_step, WorldSettings{}.time_step);
  EXPECT_EQ(std::get<UniformGravity>(settings.gravity).acceleration, Eigen::Vector3d(0, 0, -9.81));
}

TEST(Settings, FromPhysicsAndGravity) {
  const LoadedWorld loaded = load(world(
      "<gravity>1 2 -3</gravity><physics name='a' type='x'><max_step_size>0.01</max_step_size></physics>"
      "<physics name='b' type='x' default='true'><max_step_size>0.002</max_step_size></physics>"));
  EXPECT_EQ(loaded.world.settings.time_step, 0.002);
  EXPECT_EQ(std::get<UniformGravity>(loaded.world.settings.gravity).acceleration, Eigen::Vector3d(1, 2, -3));
  EXPECT_EQ(loaded.world.name, "w");
}

TEST(Settings, AllOfOurs) {
  const WorldSettings s =
      load(world("<tessera:settings><sector_size>1000</sector_size><precision>f64</precision>"
                 "<time_step>0.004</time_step><seams>clone</seams><clone_depth>3</clone_depth>"
                 "<solver_iterations>25</solver_iterations><adapt>false</adapt>"
                 "<friction_in_two_directions>false</friction_in_two_directions>"
                 "<continuous_collision>0</continuous_collision><sleep_linear_speed>0.1</sleep_linear_speed>"
                 "<sleep_angular_speed>0.2</sleep_angular_speed><sleep_after>0</sleep_after></"
                 "tessera:settings>"))
          .world.settings;
  EXPECT_EQ(s.sector_size, 1000);
  EXPECT_EQ(s.precision, Precision::kFloat64);
  EXPECT_EQ(s.time_step, 0.004);
  EXPECT_EQ(s.seams, SeamPolicy::kClone);
  EXPECT_EQ(s.clone_depth, 3);
  EXPECT_EQ(s.solver_iterations, 25);
  EXPECT_FALSE(s.adapt);
  EXPECT_FALSE(s.friction_in_two_directions);
  EXPECT_FALSE(s.continuous_collision);
  EXPECT_EQ(s.sleep_linear_speed, 0.1);
  EXPECT_EQ(s.sleep_angular_speed, 0.2);
  EXPECT_EQ(s.sleep_after, 0);
}

TEST(Settings, CentralGravity) {
  const LoadedWorld loaded =
      load(world("<tessera:central_gravity surface='9.8' radius='6e6' sector='1 -2 3' local='100 0 0'/>"));
  const auto& planet = std::get<CentralGravity>(loaded.world.settings.gravity);
  EXPECT_EQ(planet.surface, 9.8);
  EXPECT_EQ(planet.radius, 6e6);
  EXPECT_EQ(planet.centre.sector, (SectorIndex{2, -2, 3}));
  EXPECT_EQ(planet.centre.local, Eigen::Vector3d(-28, 0, 0));
}

// Places.

TEST(Places, PoseOfModelAndLink) {
  const LoadedWorld loaded = load(world(
      model("m", "<pose>100 2 3 0 0 1.5707963267948966</pose>", "<pose>1 0 0 0 0 0</pose>" + kUnitBox)));
  const BodyDescription& body = body_named(loaded, "m::l");
  EXPECT_EQ(body.pose.position.sector, (SectorIndex{1, 0, 0}));
  expect_near(body.pose.position.local, {-28, 3, 3});
  expect_near(body.pose.orientation * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
}

TEST(Places, RollPitchYawTurnAboutFixedAxes) {
  const LoadedWorld loaded = load(world(model("m", "<pose>0 0 0 0.1 0.2 0.3</pose>")));
  const Eigen::Quaterniond expected = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  EXPECT_LT(body_named(loaded, "m::l").pose.orientation.angularDistance(expected), 1e-14);
}

TEST(Places, DegreesAndQuaternions) {
  const LoadedWorld loaded =
      load(world(model("a", "<pose degrees='true'>0 0 0 0 0 90</pose>") +
                 model("b", "<pose rotation_format='quat_xyzw'>0 0 0 0 0 0.70710678 0.70710678</pose>")));
  for (const char* name : {"a::l", "b::l"}) {
    expect_near(body_named(loaded, name).pose.orientation * Eigen::Vector3d::UnitX(),
                Eigen::Vector3d::UnitY());
  }
}

TEST(Places, RelativeToFramesModelsAndTheirLinks) {
  const LoadedWorld loaded = load(
      world(model("late", "<pose relative_to='near::l'>0 0 1 0 0 0</pose>") +
            model("near", "<pose relative_to='f'>1 0 0 0 0 0</pose>", "<pose>0 5 0 0 0 0</pose>" + kUnitBox) +
            "<frame name='f' attached_to='g'><pose>10 0 0 0 0 0</pose></frame>"
            "<frame name='g'><pose>0 100 0 0 0 1.5707963267948966</pose></frame>" +
            model("free", "<pose relative_to='world'>7 0 0 0 0 0</pose>")));
  expect_near(place(loaded, "near::l"), {-5, 111, 0});
  expect_near(place(loaded, "late::l"), {-5, 111, 1});
  expect_near(place(loaded, "free::l"), {7, 0, 0});
}

TEST(Places, FramesInsideAModel) {
  const LoadedWorld loaded = load(
      world("<model name='m'><frame name='f'><pose>0 0 4 0 0 0</pose></frame><link name='a'>" + kUnitBox +
            "</link><link name='b'><pose relative_to='f'>1 0 0 0 0 0</pose>" + kUnitBox + "</link></model>"));
  expect_near(place(loaded, "m::a"), {0, 0, 0});
  expect_near(place(loaded, "m::b"), {1, 0, 4});
}

// Enough of them that where they are kept moves.
TEST(Places, ManyLinksInsideANestedModel) {
  std::string links = "<link name='l0'>" + kUnitBox + "</link>";
  for (int n = 1; n < 40; ++n) {
    const std::string name = std::to_string(n);
    links += "<link name='l" + name + "'><pose relative_to='l0'>0 0 " + name + " 0 0 0</pose>" + kUnitBox +
             "</link>";
  }
  const LoadedWorld loaded =
      load(world("<model name='m'><model name='n'><pose>0 2 0 0 0 0</pose>" + links + "</model></model>"));
  for (int n = 0; n < 40; ++n) expect_near(place(loaded, "m::n::l" + std::to_string(n)), {0, 2, double(n)});
}

TEST(Places, PlacementFrame) {
  const LoadedWorld loaded =
      load(world("<model name='m' placement_frame='top'><pose>0 0 10 0 0 0</pose><frame name='top'><pose>0 0 "
                 "2 0 0 0</pose>"
                 "</frame><link name='l'>" +
                 kUnitBox + "</link></model>"));
  expect_near(place(loaded, "m::l"), {0, 0, 8});
}

TEST(Places, NestedModels) {
  const LoadedWorld loaded =
      load(world("<model name='m'><pose>1 0 0 0 0 0</pose><link name='l'>" + kUnitBox +
                 "</link><model name='sub'><pose>0 2 0 0 0 1.5707963267948966</pose><link name='l'>"
                 "<pose>3 0 0 0 0 0</pose>" +
                 kUnitBox + "</link></model></model>"));
  EXPECT_THAT(names(loaded), ElementsAre("m::l", "m::sub::l"));
  expect_near(place(loaded, "m::sub::l"), {1, 5, 0});
}

TEST(Places, SectorsByAttributeAndElement) {
  const std::int64_t far = std::int64_t{1} << 62;
  const LoadedWorld loaded = load(world(absl::StrCat(
      "<model name='a' tessera:sector='", far, " 0 -3'><pose>100 0 0 0 0 0</pose><link name='l'>", kUnitBox,
      "</link></model>", model("b", "<tessera:sector>1 2 3</tessera:sector><pose>1 0 0 0 0 0</pose>"))));
  EXPECT_EQ(body_named(loaded, "a::l").pose.position.sector, (SectorIndex{far + 1, 0, -3}));
  EXPECT_EQ(body_named(loaded, "a::l").pose.position.local, Eigen::Vector3d(-28, 0, 0));
  EXPECT_EQ(body_named(loaded, "b::l").pose.position.sector, (SectorIndex{1, 2, 3}));
}

TEST(Places, FarModelHasTheBitsOfANearOne) {
  const std::string pose = "<pose>10.1 -20.7 30.3 0.1 0.2 0.3</pose>";
  const LoadedWorld loaded =
      load(world(model("near", pose, "<pose>3.3 0 0 1 0 0</pose>" + kUnitBox) +
                 model("far", "<tessera:sector>4000000000000000000 -7 9</tessera:sector>" + pose,
                       "<pose>3.3 0 0 1 0 0</pose>" + kUnitBox)));
  EXPECT_EQ(body_named(loaded, "near::l").pose.position.local,
            body_named(loaded, "far::l").pose.position.local);
  EXPECT_EQ(body_named(loaded, "near::l").pose.orientation.coeffs(),
            body_named(loaded, "far::l").pose.orientation.coeffs());
}

TEST(Places, VelocityOfTheWholeModel) {
  const LoadedWorld loaded = load(world(model(
      "m", "<pose>0 0 0 0 0 1.5707963267948966</pose><tessera:velocity linear='1 2 3' angular='0 0 2'/>",
      "<pose>5 0 0 0 0 0</pose>" + kUnitBox)));
  const BodyDescription& body = body_named(loaded, "m::l");
  expect_near(body.angular_velocity, {0, 0, 2});
  // The link is at (0, 5, 0) from the model's origin.
  expect_near(body.linear_velocity, {1 - 10, 2, 3});
}

// The globe.

TEST(Sites, GeodeticUpIsTheEllipsoidsNormal) {
  const LoadedWorld loaded =
      load(world("<tessera:site name='s' latitude='45' longitude='90' height='100'>" + model("a", "") +
                 model("b", "<pose>0 0 10 0 0 0</pose>") + "</tessera:site>"));
  // WGS84: N = a / sqrt(1 - e^2 sin^2); x = 0, y = (N + h) cos, z = (N (1 - e^2) + h) sin.
  const double e2 = 0.00669437999014;
  const double n = 6378137 / std::sqrt(1 - e2 / 2);
  const double c = std::sqrt(0.5);
  expect_near(place(loaded, "a::l"), {0, (n + 100) * c, (n * (1 - e2) + 100) * c}, 1e-4);
  expect_near(place(loaded, "b::l") - place(loaded, "a::l"), {0, 10 * c, 10 * c}, 1e-8);
  // East is x.
  expect_near(body_named(loaded, "a::l").pose.orientation * Eigen::Vector3d::UnitX(), {-1, 0, 0});
}

TEST(Sites, GeocentricUpIsAwayFromTheCentre) {
  const LoadedWorld loaded =
      load(world("<tessera:site name='s' latitude='45' longitude='20' frame='geocentric'>" + model("a", "") +
                 "</tessera:site>"));
  const Eigen::Vector3d up = body_named(loaded, "a::l").pose.orientation * Eigen::Vector3d::UnitZ();
  expect_near(up, place(loaded, "a::l").normalized());
}

TEST(Sites, DistancesInsideASiteAreExactToNanometres) {
  const LoadedWorld loaded =
      load(world("<tessera:site name='s' latitude='-41.2866' longitude='174.7756'>" + model("a", "") +
                 model("b", "<pose>3 0 4 0 0 0</pose>") + "</tessera:site>"));
  const WorldPosition& a = body_named(loaded, "a::l").pose.position;
  const WorldPosition& b = body_named(loaded, "b::l").pose.position;
  EXPECT_NEAR((relative_to(b, a.sector, 128) - a.local).norm(), 5, 1e-12);
}

TEST(Sites, AreFramesForOthersAndTurnVelocities) {
  const LoadedWorld loaded = load(world("<tessera:site name='s' latitude='0' longitude='90'>" +
                                        model("a", "<tessera:velocity linear='0 0 1'/>") + "</tessera:site>" +
                                        model("b", "<pose relative_to='s'>0 0 2 0 0 0</pose>")));
  expect_near(place(loaded, "b::l"), {0, 6378139, 0}, 1e-8);
  expect_near(body_named(loaded, "a::l").linear_velocity, {0, 1, 0});
}

// Includes.

TEST(Includes, ByPathFolderAndModelUri) {
  const Folder folder;
  folder.write("parts/box.sdf", model_file(model("box", "<pose>0 0 1 0 0 0</pose>")));
  folder.write("models/ball/model.config", "<model><sdf version='1.9'>ball-1.sdf</sdf></model>");
  folder.write("models/ball/ball-1.sdf", model_file(model("ball", "")));
  folder.write("crate/model.sdf", model_file(model("crate", "")));
  folder.write("models/tower.sdf", model_file(model("tower", "")));
  const LoadedWorld loaded =
      load(world("<include><uri>parts/box.sdf</uri></include>"
                 "<include><uri>parts/box.sdf</uri><name>other</name><pose>5 0 0 0 0 0</pose></include>"
                 "<include><uri>model://ball</uri><static>true</static></include>"
                 "<include><uri>model://crate</uri></include><include><uri>model://tower</uri></include>"),
           folder);
  EXPECT_THAT(names(loaded), ElementsAre("box::l", "other::l", "ball::l", "crate::l", "tower::l"));
  expect_near(place(loaded, "box::l"), {0, 0, 1});
  expect_near(place(loaded, "other::l"), {5, 0, 0});
  EXPECT_EQ(body_named(loaded, "ball::l").properties.motion, Motion::kStatic);
  EXPECT_EQ(loaded.world.shapes.size(), 1u);
}

TEST(Includes, OfAFileInTheCurrentFolder) {
  const Folder folder;
  folder.write("ball/model.sdf", model_file(model("ball", "")));
  folder.write("w.sdf", world("<include><uri>model://ball</uri></include>"));
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder);
  const absl::StatusOr<LoadedWorld> loaded = load_world_file("w.sdf");
  std::filesystem::current_path(before);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_THAT(names(*loaded), ElementsAre("ball::l"));
}

TEST(Includes, FromTheModelPath) {
  const Folder folder;
  folder.write("elsewhere/thing/model.sdf", model_file(model("thing", "")));
  const std::filesystem::path elsewhere = static_cast<const std::filesystem::path&>(folder) / "elsewhere";
  ASSERT_EQ(setenv("TESSERA_MODEL_PATH", absl::StrCat("/no/such:", elsewhere.string()).c_str(), 1), 0);
  const LoadedWorld loaded = load(world("<include><uri>model://thing</uri></include>"), folder);
  unsetenv("TESSERA_MODEL_PATH");
  EXPECT_THAT(names(loaded), ElementsAre("thing::l"));
}

// A variable of the environment for one test.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) { setenv(name, value.c_str(), 1); }
  ~Variable() { unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

TEST(Includes, FromThePathsOfGazeboAndRos) {
  const Folder folder;
  folder.write("elsewhere/thing/model.sdf", model_file(model("thing", "")));
  folder.write("elsewhere/share/thing/model.sdf", model_file(model("shared_thing", "")));
  const std::string elsewhere = (static_cast<const std::filesystem::path&>(folder) / "elsewhere").string();
  for (const char* name : {"GZ_SIM_RESOURCE_PATH", "SDF_PATH", "GAZEBO_MODEL_PATH", "ROS_PACKAGE_PATH"}) {
    const Variable path(name, absl::StrCat("/no/such:", elsewhere));
    EXPECT_THAT(names(load(world("<include><uri>package://thing</uri></include>"), folder)),
                ElementsAre("thing::l"))
        << name;
    EXPECT_THAT(names(load(world("<include><uri>thing</uri></include>"), folder)), ElementsAre("thing::l"))
        << name;
  }
  const Variable path("AMENT_PREFIX_PATH", elsewhere);
  EXPECT_THAT(names(load(world("<include><uri>package://thing</uri></include>"), folder)),
              ElementsAre("shared_thing::l"));
}

// As gz-sim's <experimental:params>.
TEST(Includes, SkipElementsOfOthers) {
  const Folder folder;
  folder.write("ball/model.sdf", model_file(model("ball", "")));
  const LoadedWorld loaded =
      load(world("<include><uri>model://ball</uri><experimental:params><x/></experimental:params></include>"),
           folder);
  EXPECT_THAT(names(loaded), ElementsAre("ball::l"));
  EXPECT_THAT(loaded.notices, Contains("1 x <experimental:params> skipped"));
}

// Links and joints of a merged model are those of the model around, which moves and turns them.
TEST(Includes, MergedIntoAModel) {
  const Folder folder;
  folder.write(
      "base.sdf",
      model_file("<model name='base'><pose>0 0 9 0 0 0</pose><link name='hub'><pose>0 0 1 0 0 0</pose>" +
                 std::string(kUnitBox) +
                 "</link><link name='arm'><pose relative_to='__model__'>1 0 1 0 0 0"
                 "</pose>" +
                 kUnitBox +
                 "</link><frame name='tip' attached_to='arm'><pose>1 0 0 0 0 0</pose>"
                 "</frame><link name='tool'><pose relative_to='tip'/>" +
                 kUnitBox +
                 "</link><joint name='turn' type='revolute'><parent>__model__</parent><child>arm</child>"
                 "<axis><xyz expressed_in='__model__'>0 1 0</xyz></axis></joint></model>"));
  const std::string robot =
      "<model name='robot'><pose>0 5 0 0 0 1.5707963267948966</pose><include merge='true'><uri>base.sdf</uri>"
      "<pose>2 0 0 0 0 0</pose></include><link name='box'><pose relative_to='arm'>0 0 1 0 0 0</pose>" +
      std::string(kUnitBox) + "</link></model>";
  const LoadedWorld loaded = load(absl::StrCat("<sdf version='1.9'>", robot, "</sdf>"), folder);
  EXPECT_THAT(names(loaded), UnorderedElementsAre("robot::box", "robot::hub", "robot::arm", "robot::tool"));
  expect_near(place(loaded, "robot::hub"), {0, 7, 1});
  expect_near(place(loaded, "robot::arm"), {0, 8, 1});
  expect_near(place(loaded, "robot::tool"), {0, 9, 1});
  expect_near(place(loaded, "robot::box"), {0, 8, 2});
  ASSERT_EQ(loaded.world.joints.size(), 1u);
  EXPECT_EQ(loaded.world.joints[0].name, "robot::turn");
}

TEST(Includes, OfTheModelThatAFileIsPartOf) {
  const Folder folder;
  folder.write("arm/model.config", "<model/>");
  folder.write("arm/meshes/t.obj", kTetrahedra);
  folder.write("hand/model.sdf", model_file(model("hand", "")));
  const std::filesystem::path urdf = static_cast<const std::filesystem::path&>(folder) / "arm/urdf";
  const std::string mesh = collision("<mesh><uri>model://arm/meshes/t.obj</uri></mesh>");
  const LoadedWorld loaded =
      load(world("<include><uri>model://hand</uri></include>" + model("m", "", mesh)), urdf);
  EXPECT_THAT(names(loaded), ElementsAre("hand::l", "m::l"));
  // Without the file that says that it is a package, in the place where packages have their robots.
  folder.write("leg/meshes/t.obj", kTetrahedra);
  load(world(model("m", "", collision("<mesh><uri>package://leg_support/meshes/t.obj</uri></mesh>"))),
       static_cast<const std::filesystem::path&>(folder) / "leg/urdf");
  // Whatever the folder of the package is called.
  load(world(model("m", "", collision("<mesh><uri>package://arm_description/meshes/t.obj</uri></mesh>"))),
       urdf);
}

TEST(Includes, NestedWithMeshesBesideTheirFile) {
  const Folder folder;
  folder.write("a/outer.sdf", model_file("<model name='outer'><link name='l'>" + kUnitBox +
                                         "</link><include><uri>../b/inner.sdf</uri><name>in</name>"
                                         "<pose>0 0 2 0 0 0</pose></include></model>"));
  folder.write("b/inner.sdf", model_file(model("inner", "", collision("<mesh><uri>t.obj</uri></mesh>"))));
  folder.write("b/t.obj", kTetrahedra);
  const LoadedWorld loaded = load(world("<include><uri>a/outer.sdf</uri></include>"), folder);
  EXPECT_THAT(names(loaded), ElementsAre("outer::l", "outer::in::l"));
  expect_near(place(loaded, "outer::in::l"), {0, 0, 2});
  EXPECT_EQ(shape_of(loaded, body_named(loaded, "outer::in::l")).parts.size(), 2u);
}

TEST(Includes, NestedOfAnotherVersionAndOfUrdf) {
  const Folder folder;
  folder.write("old.sdf", model_file(model("old", "<pose frame=''>0 0 1 0 0 0</pose>"), "1.5"));
  folder.write(
      "robot.urdf",
      "<robot name='robot'><link name='base'><inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' "
      "iyy='1' iyz='0' izz='1'/></inertial><collision><geometry><box size='1 1 1'/></geometry></collision>"
      "</link></robot>");
  const LoadedWorld loaded =
      load(world("<model name='m'><link name='l'>" + kUnitBox +
                     "</link><include><uri>old.sdf</uri></include>"
                     "<include><uri>robot.urdf</uri><pose>3 0 0 0 0 0</pose></include></model>",
                 "1.6"),
           folder);
  EXPECT_THAT(names(loaded), ElementsAre("m::l", "m::old::l", "m::robot::base"));
  expect_near(place(loaded, "m::old::l"), {0, 0, 1});
  expect_near(place(loaded, "m::robot::base"), {3, 0, 0});
}

TEST(Includes, OfTheNetworkAndOfLightsAreSkipped) {
  const Folder folder;
  folder.write("sun.sdf", "<sdf version='1.9'><light name='sun' type='directional'/></sdf>");
  const LoadedWorld loaded = load(world("<include><uri>https://example.org/a</uri></include>"
                                        "<include><uri>sun.sdf</uri></include>"),
                                  folder);
  EXPECT_THAT(names(loaded), IsEmpty());
  EXPECT_THAT(loaded.notices, ElementsAre("1 x <include> of a file without model, skipped",
                                          "1 x <include> of the network, skipped: 1 model is not in Gazebo's "
                                          "cache: https://example.org/a"));
}

// What is left out.

TEST(NoticeLines, CountByKind) {
  const std::string visual = "<visual name='v'><geometry><box/></geometry></visual>";
  const LoadedWorld loaded = load(world(
      "<light name='sun' type='point'/><plugin name='p' filename='f'/><scene/>" +
      model("a", "<plugin name='p' filename='f'/>", visual + "<sensor name='s' type='imu'/>" + kUnitBox) +
      model("b", "", visual + kUnitBox) + model("c", "", visual) +
      model("d", "", collision("<torus><radius>1</radius></torus>")) +
      model("e", "", "<collision name='c'/>") +
      model("f", "", collision("<boks><size>1 1 1</size></boks>"))));
  EXPECT_THAT(names(loaded), ElementsAre("a::l", "b::l"));
  EXPECT_THAT(
      loaded.notices,
      ElementsAre("1 x <light> skipped", "2 x <plugin> f skipped", "1 x <scene> skipped",
                  "1 x <sensor> imu is the program imu", "3 x <visual> for the web UI alone",
                  "1 x collision with the geometry <boks>, which is not supported, skipped; the nearest "
                  "known is <box>",
                  "1 x collision with the geometry <torus>, which is not supported, skipped",
                  "1 x collision without geometry, skipped", "4 x link without collision shape, skipped"));
}

TEST(NoticeLines, JointsAndLinksFixedToTheWorld) {
  const auto link = [](const std::string& name) {
    return "<link name='" + name + "'>" + kUnitBox + "</link>";
  };
  const LoadedWorld loaded =
      load(world("<model name='m'>" + link("a") + link("b") + link("c") + link("d") +
                 "<joint name='fix' type='fixed'><parent>world</parent><child>a</child></joint>"
                 "<joint name='glue' type='fixed'><parent>a</parent><child>b</child></joint>"
                 "<joint name='turn' type='revolute'><parent>b</parent><child>c</child><axis><xyz>0 0 "
                 "1</xyz></axis></joint>"
                 "<joint name='slide' type='prismatic'><parent>c</parent><child>d</child><axis><xyz>0 0 "
                 "1</xyz></axis></joint>"
                 "</model>"));
  EXPECT_EQ(body_named(loaded, "m::a").properties.motion, Motion::kStatic);
  EXPECT_EQ(body_named(loaded, "m::b").properties.motion, Motion::kStatic);
  EXPECT_EQ(body_named(loaded, "m::c").properties.motion, Motion::kDynamic);
  EXPECT_THAT(loaded.notices, ElementsAre("2 x link fixed to the world, treated as static",
                                          "2 joints (1 prismatic, 1 revolute) simulated"));
}

TEST(NoticeLines, JointsOfStaticModels) {
  const LoadedWorld loaded = load(world(
      "<model name='m'><static>true</static><link name='a'>" + kUnitBox + "</link><link name='b'>" +
      kUnitBox + "</link><joint name='j' type='ball'><parent>a</parent><child>b</child></joint></model>"));
  EXPECT_THAT(loaded.notices, ElementsAre("1 x joint between links that no force moves, skipped"));
}

TEST(NoticeLines, LinkOfAJointWithoutShapeMeetsNothing) {
  const LoadedWorld loaded =
      load(world("<model name='m'><link name='a'/><link name='b'>" + kUnitBox +
                 "</link><joint name='j' type='ball'><parent>a</parent><child>b</child></joint></model>"));
  EXPECT_EQ(body_named(loaded, "m::a").properties.mask, 0u);
  EXPECT_EQ(body_named(loaded, "m::a").properties.category, 0u);
}

TEST(NoticeLines, SphericalCoordinates) {
  EXPECT_THAT(load(world("<spherical_coordinates/>")).notices,
              ElementsAre(HasSubstr("positions stay in the file's local frame")));
}

// Files of models and robots.

TEST(ModelFiles, AreWorldsOfTheirOwn) {
  const LoadedWorld loaded = load(model_file(model("alone", "<pose>1 2 3 0 0 0</pose>")));
  EXPECT_EQ(loaded.world.name, "alone");
  expect_near(place(loaded, "alone::l"), {1, 2, 3});
}

// Links far down a chain are where their joints put them, and do not take longer to find than the first ones.
TEST(Urdf, AChainOfFiveHundredLinksThatCurls) {
  constexpr int kLinks = 500;
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";
  const std::string box = "<collision><geometry><box size='0.1 0.1 0.1'/></geometry></collision>";
  std::string robot = absl::StrCat("<robot name='r'><link name='l0'>", inertial, box, "</link>");
  for (int n = 1; n < kLinks; ++n) {
    absl::StrAppend(&robot, "<link name='l", n, "'>", inertial, box, "</link><joint name='j", n,
                    "' type='continuous'><origin xyz='0 0 0.5' rpy='0.03 0.01 0'/><parent link='l", n - 1,
                    "'/><child link='l", n, "'/><axis xyz='1 0 0'/></joint>");
  }
  const LoadedWorld loaded = load(robot + "</robot>");
  ASSERT_EQ(loaded.world.bodies.size(), std::size_t{kLinks});
  const Pose step{
      {0, 0, 0.5},
      Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitX())};
  Pose pose;
  for (int n = 0; n < kLinks; ++n) {
    expect_near(place(loaded, absl::StrCat("r::l", n)), pose.position, 1e-10);
    pose = pose * step;
  }
}

TEST(Urdf, CapsulesBallJointsAndMasslessRoots) {
  const std::string inertia = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>";
  const LoadedWorld loaded = load(
      "<robot name='r'><link name='root'><inertial><mass value='0'/></inertial><collision><geometry>"
      "<box size='1 1 1'/></geometry></collision></link>"
      "<link name='arm'><inertial><mass value='3'/>" +
      inertia +
      "</inertial><visual/><collision><geometry>"
      "<capsule radius='0.1' length='0.5'/></geometry></collision></link>"
      "<joint name='j' type='spherical'><parent link='root'/><child link='arm'/><origin xyz='0 0 "
      "2'/></joint></robot>");
  EXPECT_EQ(body_named(loaded, "r::root").properties.motion, Motion::kStatic);
  EXPECT_EQ(body_named(loaded, "r::arm").properties.mass, 3);
  EXPECT_EQ(only_geometry<Capsule>(loaded, body_named(loaded, "r::arm")).length, 0.5);
  expect_near(place(loaded, "r::arm"), {0, 0, 2});
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("(1 ball)")));
}

}  // namespace
}  // namespace tessera
