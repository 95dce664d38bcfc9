// Nothing is lost in reading: what files name is found where Gazebo and ROS find it, and what is not there is
// told.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "worlds/loader/mesh_text.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::UnorderedElementsAre;

using std::filesystem::path;

// A variable of the environment, during a test.
class Given {
 public:
  Given(const char* name, const path& value) : name_(name) {
    if (const char* before = getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Given() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }
  Given(const Given&) = delete;
  Given& operator=(const Given&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

const std::string kTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string include(const std::string& uri) {
  return absl::StrCat("<include><uri>", uri, "</uri></include>");
}

std::string mesh(const std::string& uri) {
  return collision(absl::StrCat("<mesh><uri>", uri, "</uri></mesh>"));
}

std::string urdf_with_mesh(const std::string& file) {
  return absl::StrCat(
      "<robot name='arm'><link name='base'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
      "iyy='1' "
      "iyz='0' izz='1'/></inertial><collision><geometry><mesh filename='",
      file, "'/></geometry></collision></link></robot>");
}

std::string manifest(const std::string& name) {
  return absl::StrCat("<package format='2'><name>", name, "</name></package>");
}

LoadedWorld load_file(const path& file) {
  absl::StatusOr<LoadedWorld> loaded = load_world_file(file);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? *std::move(loaded) : LoadedWorld{};
}

std::string error_of(const std::string& xml, const path& folder, Faults faults = Faults::kRepair) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(xml, folder, faults);
  EXPECT_FALSE(loaded.ok());
  return std::string(loaded.status().message());
}

// Packages and models.

// The robot has no package.xml around it: the folder's name makes it the package, for one URI, but not for
// the path that the URI leads to.
TEST(Found, AMeshOfAPackageStaysFound) {
  const Folder folder;
  folder.write("arm/meshes/a.obj", kTetrahedron);
  folder.write("arm/robots/a/a.urdf", urdf_with_mesh("package://arm/meshes/a.obj"));
  EXPECT_THAT(names(load_file(folder / path("arm/robots/a/a.urdf"))), ElementsAre("arm::base"));
}

TEST(Found, AMeshOfAnIncludedRobot) {
  const Folder folder;
  folder.write("robots/arm/meshes/a.obj", kTetrahedron);
  folder.write("robots/arm/urdf/a.urdf", urdf_with_mesh("package://arm/meshes/a.obj"));
  folder.write("w.sdf", world(include("robots/arm/urdf/a.urdf")));
  EXPECT_THAT(names(load_file(folder / path("w.sdf"))), ElementsAre("arm::base"));
}

TEST(Found, PackagesByTheNamesInTheirManifests) {
  const Folder folder;
  folder.write("ws/config/package.xml", manifest("arm_config"));
  folder.write("ws/config/a.urdf", urdf_with_mesh("package://arm_description/meshes/a.obj"));
  folder.write("ws/description/package.xml", manifest("arm_description"));
  folder.write("ws/description/meshes/a.obj", kTetrahedron);
  EXPECT_THAT(names(load_file(folder / path("ws/config/a.urdf"))), ElementsAre("arm::base"));
}

TEST(Found, PackagesByTheirNamesFarBelowTheListedFolders) {
  const Folder folder;
  folder.write("elsewhere/a.urdf", urdf_with_mesh("package://arm_description/meshes/a.obj"));
  folder.write("ws/src/stack/description/package.xml", manifest("arm_description"));
  folder.write("ws/src/stack/description/meshes/a.obj", kTetrahedron);
  EXPECT_FALSE(load_world_file(folder / path("elsewhere/a.urdf")).ok());
  for (const char* variable : {"ROS_PACKAGE_PATH", "TESSERA_MODEL_PATH"}) {
    const Given listed(variable, folder / path("ws"));
    EXPECT_THAT(names(load_file(folder / path("elsewhere/a.urdf"))), ElementsAre("arm::base")) << variable;
  }
}

// Of packages with one name, the nearest one counts, and of these the first by its folder.
TEST(Found, OfTwoPackagesTheSameOneEachTime) {
  const Folder folder;
  folder.write("x/a.urdf", urdf_with_mesh("package://arm/a.obj"));
  folder.write("ws/b/package.xml", manifest("arm"));
  folder.write("ws/b/a.obj", kTetrahedron);
  folder.write("ws/c/package.xml", manifest("arm"));
  folder.write("ws/a/deep/package.xml", manifest("arm"));
  const Given listed("ROS_PACKAGE_PATH", folder / path("ws"));
  EXPECT_THAT(names(load_file(folder / path("x/a.urdf"))), ElementsAre("arm::base"));
}

TEST(Found, AFolderWithoutAModelIsNone) {
  const Folder folder;
  folder.write("thing/package.xml", manifest("thing"));
  folder.write("shop/models/thing/model.config",
               "<model><name>thing</name><sdf version='1.6'>thing.sdf</sdf></model>");
  folder.write("shop/models/thing/thing.sdf", model_file(model("thing", "")));
  const Given listed("GAZEBO_MODEL_PATH", folder / path("shop/models"));
  EXPECT_THAT(names(load(world(include("model://thing")), folder)), ElementsAre("thing::l"));
  EXPECT_THAT(names(load(world(include("thing")), folder)), ElementsAre("thing::l"));
}

TEST(Found, ModelsBesideTheFolderOfWorlds) {
  const Folder folder;
  folder.write("models/thing/model.sdf", model_file(model("thing", "", mesh("model://thing/a.obj"))));
  folder.write("models/thing/a.obj", kTetrahedron);
  for (const char* file : {"worlds/w.sdf", "worlds/small/w.sdf", "world/w.sdf"}) {
    folder.write(file, world(include("model://thing")));
    EXPECT_THAT(names(load_file(folder / path(file))), ElementsAre("thing::l")) << file;
  }
}

TEST(Found, ModelsInThePackageOfAWorld) {
  const Folder folder;
  folder.write("pkg/package.xml", manifest("pkg"));
  folder.write("pkg/models/thing/model.sdf", model_file(model("thing", "")));
  folder.write("pkg/launch/w.sdf", world(include("model://thing")));
  EXPECT_THAT(names(load_file(folder / path("pkg/launch/w.sdf"))), ElementsAre("thing::l"));
}

// What every Gazebo has.

TEST(Found, TheSunAndTheGroundPlaneAreBuiltIn) {
  const Folder folder;
  for (const std::string prefix : {"model://", "https://fuel.gazebosim.org/1.0/OpenRobotics/models/"}) {
    const LoadedWorld loaded =
        load(world(include(prefix + "sun") +
                   absl::StrCat("<include><uri>", prefix,
                                "ground_plane</uri><pose>0 0 -1 0 0 0</pose></include>")),
             folder);
    EXPECT_THAT(names(loaded), ElementsAre("ground_plane::link")) << prefix;
    EXPECT_THAT(loaded.notices, ElementsAre("1 x <include> of a file without model, skipped"));
    const BodyDescription& ground = body_named(loaded, "ground_plane::link");
    EXPECT_EQ(ground.properties.motion, Motion::kStatic);
    EXPECT_EQ(ground.properties.friction, 100);
    EXPECT_EQ(only_geometry<Plane>(loaded, ground).normal, Eigen::Vector3d::UnitZ());
    expect_near(place(loaded, "ground_plane::link"), {0, 0, -1});
  }
}

TEST(Found, AGroundPlaneOfTheUserComesFirst) {
  const Folder folder;
  folder.write("ground_plane/model.sdf", model_file(model("mine", "<static>true</static>")));
  EXPECT_THAT(names(load(world(include("model://ground_plane")), folder)), ElementsAre("mine::l"));
}

// Models of the network.

TEST(Network, ModelsInGazebosCache) {
  const Folder folder;
  const std::string models = "cache/fuel.gazebosim.org/openrobotics/models/";
  folder.write(models + "red buoy/2/model.sdf", model_file(model("old", "")));
  folder.write(models + "red buoy/10/model.sdf", model_file(model("buoy", "", mesh("meshes/a.obj"))));
  folder.write(models + "red buoy/10/meshes/a.obj", kTetrahedron);
  const Given cache("GZ_FUEL_CACHE_PATH", folder / path("cache"));
  for (const char* uri : {"https://fuel.gazebosim.org/1.0/OpenRobotics/models/Red%20Buoy",
                          "https://fuel.gazebosim.org/1.0/openrobotics/models/Red Buoy/tip",
                          "https://fuel.ignitionrobotics.org/1.0/OpenRobotics/models/Red Buoy",
                          "https://app.gazebosim.org/OpenRobotics/fuel/models/Red Buoy"}) {
    const LoadedWorld loaded = load(world(include(uri)), folder);
    EXPECT_THAT(names(loaded), ElementsAre("buoy::l")) << uri;
    EXPECT_THAT(loaded.notices, IsEmpty()) << uri;
  }
  const std::string exact = "https://fuel.gazebosim.org/1.0/OpenRobotics/models/Red Buoy/2";
  EXPECT_THAT(names(load(world(include(exact)), folder)), ElementsAre("old::l"));
  const std::string file =
      "https://fuel.gazebosim.org/1.0/OpenRobotics/models/Red Buoy/tip/files/meshes/a.obj";
  EXPECT_THAT(names(load(world(model("m", "", mesh(file))), folder)), ElementsAre("m::l"));
}

TEST(Network, TheCacheIsInTheHomeOfTheUser) {
  const Folder folder;
  folder.write(".ignition/fuel/fuel.ignitionrobotics.org/OpenRobotics/models/Cone/1/model.sdf",
               model_file(model("cone", "")));
  const Given home("HOME", folder);
  const std::string uri = "https://fuel.ignitionrobotics.org/1.0/OpenRobotics/models/Cone";
  EXPECT_THAT(names(load(world(include(uri)), folder)), ElementsAre("cone::l"));
}

TEST(Network, NothingOutsideOfTheCacheIsRead) {
  const Folder folder;
  folder.write("secret/model.sdf", model_file(model("secret", "")));
  folder.write("cache/fuel.gazebosim.org/o/models/m/1/model.sdf", model_file(model("m", "")));
  std::filesystem::create_directory_symlink(folder / path("secret"),
                                            folder / path("cache/fuel.gazebosim.org/o/models/link"));
  const Given cache("GZ_FUEL_CACHE_PATH", folder / path("cache"));
  for (const char* name :
       {"m/../../../../secret", "%2e%2e/..", "m%2f..%2f..", "link", "../../../../secret"}) {
    const LoadedWorld loaded =
        load(world(include(absl::StrCat("https://fuel.gazebosim.org/1.0/o/models/", name))), folder);
    EXPECT_THAT(names(loaded), IsEmpty()) << name;
  }
}

TEST(Network, OneLineSaysHowManyModelsAreMissing) {
  const Folder folder;
  const std::string here = "https://fuel.gazebosim.org/1.0/o/models/";
  std::string includes =
      include(here + "a") + include(here + "a") + include(here + "b") + include("https://x.org/c");
  const LoadedWorld loaded = load(world(model("box", "") + includes), folder);
  EXPECT_THAT(names(loaded), ElementsAre("box::l"));
  EXPECT_THAT(loaded.notices,
              ElementsAre(absl::StrCat(
                  "4 x <include> of the network, skipped: 3 models are not in Gazebo's cache: ", here, "a, ",
                  here, "b, https://x.org/c")));
  EXPECT_THAT(loaded.repairs, IsEmpty());
  EXPECT_THAT(error_of(world(model("box", "") + includes), folder, Faults::kRefuse),
              AllOf(HasSubstr("has faults: 4 x <include> of the network"), HasSubstr(here + "b")));
}

TEST(Network, ManyMissingModelsAreNotAllNamed) {
  const Folder folder;
  std::string includes;
  for (int n = 0; n < 100; ++n) includes += include(absl::StrCat("https://x.org/", n));
  const LoadedWorld loaded = load(world(includes), folder);
  ASSERT_THAT(loaded.notices, SizeIs(1));
  EXPECT_THAT(loaded.notices.front(), AllOf(HasSubstr("100 models"), HasSubstr("and 80 more")));
}

// The world is what it would be without them, and so are models that consist of nothing else.
TEST(Network, WhatHangsOnMissingModelsIsLeftOutByName) {
  const Folder folder;
  const std::string buoy =
      "<include><name>buoy</name><uri>https://fuel.gazebosim.org/1.0/o/models/buoy</uri></include>";
  const std::string ball = "<link name='ball'>" + kUnitBox + "</link>";
  const LoadedWorld loaded =
      load(world("<model name='course'>" + buoy + "<model name='lane'>" + buoy + "</model></model>" +
                 "<model name='ship'>" + ball + buoy +
                 "<frame name='top' attached_to='buoy::mast'/><frame name='tip' attached_to='top'/>"
                 "<joint name='moor' type='fixed'><parent>ball</parent><child>buoy::hull</child></joint>"
                 "<joint name='turn' type='ball'><parent>world</parent><child>ball</child></joint></model>"),
           folder);
  EXPECT_THAT(names(loaded), ElementsAre("ship::ball"));
  EXPECT_THAT(loaded.notices,
              AllOf(Contains("2 x <frame> with a model that was left out, skipped"),
                    Contains("1 x <joint> with a model that was left out, skipped"),
                    Contains("1 x <model> with a model that was left out, skipped"),
                    Contains("1 x <model> with nothing but what was left out, skipped"),
                    Contains(HasSubstr("3 x <include> of the network, skipped: 1 model is not")),
                    Contains("1 joint (1 ball) simulated")));
}

TEST(Network, AnIncludedFileOfNothingElse) {
  const Folder folder;
  folder.write("course.sdf", model_file("<model name='course'>" + include("https://x.org/a") + "</model>"));
  const LoadedWorld loaded =
      load(world(model("box", "") + include("course.sdf") + include("course.sdf")), folder);
  EXPECT_THAT(names(loaded), ElementsAre("box::l"));
  EXPECT_THAT(loaded.notices, Contains("2 x <model> with nothing but what was left out, skipped"));
}

// Missing files.

TEST(Missing, AllOfAFileAreToldAtOnce) {
  const Folder folder;
  folder.write("half/model.sdf", model_file(model("half", "", mesh("inner.stl"))));
  folder.write("arm.urdf", urdf_with_mesh("package://arm/outer.stl"));
  const std::string heights = collision("<heightmap><uri>heights.png</uri><size>1 1 1</size></heightmap>");
  const std::string error =
      error_of(world(include("model://half") + include("model://nowhere") + include("model://nowhere") +
                     model("m", "", mesh("hull.obj")) + model("n", "<static>true</static>", heights) +
                     include("arm.urdf") + "<frame name='f' attached_to='nowhere::l'/>"),
               folder);
  for (const char* missing : {"inner.stl", "outer.stl", "model://nowhere", "hull.obj", "heights.png"})
    EXPECT_THAT(error, HasSubstr(missing));
  EXPECT_THAT(error, AllOf(HasSubstr("files were not found"), HasSubstr("model.sdf:1: <uri>"),
                           HasSubstr("<string>:1: <uri> of <collision name='c'>: 'hull.obj'"),
                           HasSubstr("searched")));
}

TEST(Missing, OneIsToldAsBefore) {
  const Folder folder;
  const std::string error = error_of(world(model("m", "", mesh("hull.obj"))), folder);
  EXPECT_THAT(error, AllOf(HasSubstr("'hull.obj' was not found; searched"), Not(HasSubstr("files were"))));
}

// Meshes.

// Vertices without a digit before the point.
TEST(Found, ObjFilesWithBarePoints) {
  const Folder folder;
  folder.write("flat.obj",
               "# .5 stays\nv -.5 -.5 0\nv\t.5 -.5 .0\nv .5 .5 0\nv -.5 .5 .25e1\nf 1 2 3\nf 1 3 4\n");
  const LoadedWorld loaded = load(world(model("m", "<static>true</static>", mesh("flat.obj"))), folder);
  EXPECT_THAT(only_geometry<TriangleMesh>(loaded, body_named(loaded, "m::l")).vertices,
              UnorderedElementsAre(Eigen::Vector3d(-0.5, -0.5, 0), Eigen::Vector3d(0.5, -0.5, 0),
                                   Eigen::Vector3d(0.5, 0.5, 0), Eigen::Vector3d(-0.5, 0.5, 2.5)));
}

TEST(Found, OnlyNumbersOfVerticesGetADigit) {
  EXPECT_EQ(amended_obj("v -.5 \\\n+.5 1.5\r\n vn .5 0 .\no .5\nusemtl .5\nv ..5 a.5 .5"),
            "v -0.5 \\\n+0.5 1.5\r\n vn 0.5 0 .\no .5\nusemtl .5\nv ..5 a.5 0.5");
  EXPECT_EQ(amended_obj("v 0.5 1. 2\no .5\n.5"), std::nullopt);
}

// Blanks before numbers of any kind, and colours that are none, of materials that are not used.
TEST(Found, ColladaWithBlanks) {
  const Folder folder;
  for (const char* color : {"   0.3 0.3 0.3 1", "red"}) {
    folder.write(
        "a.dae",
        absl::StrCat(
            "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' "
            "version='1.4.1'>"
            "<asset><unit meter='1'/><up_axis> Z_UP</up_axis></asset>"
            "<library_effects><effect id='E'><profile_COMMON><technique sid='c'><blinn><emission><color>",
            color,
            "</color></emission><shininess><float> 1</float></shininess></blinn></technique></profile_COMMON>"
            "</effect></library_effects><library_materials><material id='M'><instance_effect "
            "url='#E'/></material>"
            "</library_materials><library_geometries><geometry id='G'><mesh><source id='P'>"
            "<float_array id='A' count='12'>\n  0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>"
            "<accessor count='4' source='#A' stride='3'><param name='X' type='float'/><param name='Y' "
            "type='float'/><param name='Z' type='float'/></accessor></technique_common></source>"
            "<vertices id='V'><input semantic='POSITION' source='#P'/></vertices>"
            "<triangles count='4' material='m'><input offset='0' semantic='VERTEX' source='#V'/>"
            "<p> 0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>"
            "<library_visual_scenes><visual_scene id='S'><node><translate> 0 0 1</translate>"
            "<instance_geometry url='#G'><bind_material><technique_common><instance_material symbol='m' "
            "target='#M'/></technique_common></bind_material></instance_geometry></node></visual_scene>"
            "</library_visual_scenes><scene><instance_visual_scene url='#S'/></scene></COLLADA>"));
    const LoadedWorld loaded = load(world(model("m", "", mesh("a.dae"))), folder);
    EXPECT_THAT(only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l")).points,
                UnorderedElementsAre(Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 1),
                                     Eigen::Vector3d(0, 1, 1), Eigen::Vector3d(0, 0, 2)))
        << color;
  }
}

// The files of the issue.

class FilesOfOthers : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TESSERA_WORLDS");
    if (folder == nullptr) GTEST_SKIP() << "TESSERA_WORLDS is not set";
    files_ = path(folder) / "files";
    if (!std::filesystem::exists(files_)) GTEST_SKIP() << "there is no " << files_;
  }

  path files_;
};

TEST_F(FilesOfOthers, Load) {
  for (const auto& [file, bodies] :
       {std::pair{"05_package_found_then_refused/arm_description/robots/a/a.urdf", 1},
        {"06_blank_before_color/model.sdf", 1},
        {"08_only_network_includes.sdf", 1},
        {"09_package_name/arm_config/a.urdf", 1},
        {"11_sun_is_missing.sdf", 2},
        {"12_mass_0_on_fixed_joint_loses_legs.urdf", 2}}) {
    EXPECT_THAT(load_file(files_ / file).world.bodies, SizeIs(bodies)) << file;
  }
  const Given listed("GAZEBO_MODEL_PATH", files_ / "07_folder_is_no_model/pkg/models");
  EXPECT_THAT(names(load_file(files_ / "07_folder_is_no_model/pkg/worlds/w.world")), ElementsAre("thing::l"));
  EXPECT_THAT(load_file(files_ / "12_mass_0_on_fixed_joint_loses_legs.urdf").world.joints, SizeIs(1));
}

TEST_F(FilesOfOthers, OfContactsLoadWithAllThatTheySay) {
  const path contact = files_.parent_path() / "contact";
  const LoadedWorld flat = load_file(contact / "obj_dotfive.sdf");
  EXPECT_THAT(only_geometry<TriangleMesh>(flat, body_named(flat, "s::l")).vertices,
              UnorderedElementsAre(Eigen::Vector3d(-0.5, -0.5, 0), Eigen::Vector3d(0.5, -0.5, 0),
                                   Eigen::Vector3d(0.5, 0.5, 0), Eigen::Vector3d(-0.5, 0.5, 0)));
  const LoadedWorld features = load_file(contact / "sdf_features.sdf");
  EXPECT_THAT(features.notices, Contains(HasSubstr("1 x <fdir1> expressed in 'base'")));
  const Shape& shape = shape_of(features, body_named(features, "w::l"));
  ASSERT_THAT(shape.parts, SizeIs(2));
  EXPECT_EQ(shape.parts[0].material, (PartMaterial{0.5, 0.5, 2, 3, {}}));
  EXPECT_EQ(shape.parts[1].material, (PartMaterial{1, 0, 0xffff, 0xffff, {}}));
  EXPECT_FALSE(load_world_file(contact / "sdf_features.sdf", Faults::kRefuse).ok());
}

}  // namespace
}  // namespace tessera
