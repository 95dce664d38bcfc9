// Files that cannot be simulated are refused, with the element and the bound in the message.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string>
#include <vector>

#include "lpss/model/limits.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

using testing::HasSubstr;

constexpr absl::StatusCode kInvalid = absl::StatusCode::kInvalidArgument;
constexpr absl::StatusCode kNotFound = absl::StatusCode::kNotFound;
constexpr absl::StatusCode kOutOfRange = absl::StatusCode::kOutOfRange;

struct Row {
  std::string name;
  std::string xml;
  std::vector<std::string> said;
  absl::StatusCode code = kInvalid;

  friend void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }
};

std::string world(const std::string& body) {
  return absl::StrCat("<sdf version='1.9'>\n<world name='w'>\n", body, "\n</world></sdf>");
}

std::string settings(const std::string& body) {
  return world(absl::StrCat("<tessera:settings>", body, "</tessera:settings>"));
}

// A model 'm' with a link 'l'; the geometry, and what else is wanted.
std::string model(const std::string& geometry, const std::string& of_link = "",
                  const std::string& of_model = "", const std::string& surface = "") {
  return world(absl::StrCat("<model name='m'>\n", of_model, "<link name='l'>\n", of_link,
                            "<collision name='c'>\n<geometry>\n", geometry, "\n</geometry>", surface,
                            "</collision></link></model>"));
}

std::string box(const std::string& of_link = "", const std::string& of_model = "") {
  return model("<box><size>1 1 1</size></box>", of_link, of_model);
}

// A model 'm' with a hinge 'j', and what else is wanted of it.
std::string joint(const std::string& of_joint, const std::string& of_axis = "") {
  return world(
      absl::StrCat("<model name='m'><link name='a'/><link name='b'/>\n<joint name='j' type='revolute'>",
                   "<parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>", of_axis, "</axis>\n", of_joint,
                   "</joint></model>"));
}

std::string mass(const std::string& value) {
  return absl::StrCat("<inertial><mass>", value, "</mass></inertial>");
}

std::string include(const std::string& body) { return world(absl::StrCat("<include>", body, "</include>")); }

std::string nested(int depth) {
  std::string open;
  std::string close;
  for (int n = 0; n < depth; ++n) {
    open += "<a>";
    close += "</a>";
  }
  return world(open + close);
}

std::string urdf(const std::string& body) {
  return absl::StrCat(
      "<robot name='r'><link name='base'><inertial><mass value='1'/>"
      "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>",
      body, "</robot>");
}

std::vector<Row> xml_rows() {
  return {
      {"Empty", "", {"<string>: malformed XML: the text is empty"}},
      {"Binary", std::string("\0\1", 2), {"<string>: malformed XML: a byte is 0, so this is no text"}},
      {"NoXml", "once upon a time", {"<string>:1: malformed XML: there is text outside of all elements"}},
      {"Unclosed", "<sdf>\n<world name='w'>\n<model>", {"<string>:3: malformed XML: <model> is not closed"}},
      {"Mismatched",
       "<sdf version='1.9'><world></sdf></world>",
       {":1: malformed XML: <world> is not closed"}},
      {"Unquoted", "<sdf version=1.9/>", {"attribute of <sdf> must", "name=\"value\""}},
      {"AttributeTwice", "<sdf version='1.9' version='1.9'/>", {"attribute of <sdf> must occur once"}},
      {"EndlessTag", "<sdf version='1.9'>\n<world", {":2: malformed XML: the tag <world> has no end"}},
      {"EndlessComment", "<sdf version='1.9'><!-- <world/>", {"a comment has no -->"}},
      {"EndlessText", "<sdf version='1.9'><![CDATA[ 1", {"a <![CDATA[ has no ]]>"}},
      {"LateDeclaration", "<sdf version='1.9'/><?xml version='1.0'?>", {"<?...?>", "after an element"}},
      {"NoTag", "<1df/>", {"a < begins no tag"}},
      {"NoTagWithin", "<sdf>\n<world>\n1 < 2</world></sdf>", {":3: malformed XML: a < begins no tag"}},
      {"EndsTooSoon",
       "<sdf version='1.9'>\n<world name='w'>\n<model name='m'>\n</model>\n",
       {":2: malformed XML: the text ends before an element that begins here is closed"}},
      {"EntityBomb",
       "<!DOCTYPE x [<!ENTITY a 'ha'><!ENTITY b '&a;&a;'>]><sdf version='1.9'/>",
       {"DOCTYPE", "not allowed"}},
      {"DeeplyNested", nested(70), {"nested deeper than 64"}},
      {"VeryDeeplyNested", nested(100000), {"nested deeper than 64"}},
      {"OtherRoot", "<html/>", {"<html>", "<sdf>, <robot> or <mujoco>"}},
      {"NoVersion", "<sdf><world name='w'/></sdf>", {"<sdf>", "'version' is missing"}},
      {"StrangeVersion", "<sdf version='2.0'><world name='w'/></sdf>", {"'2.0'", "1.9"}},
      {"NoWorld", "<sdf version='1.9'/>", {"neither a <world> nor a <model>"}},
  };
}

std::vector<Row> placement_rows() {
  return {
      {"NameMissing", world("<model><link name='l'/></model>"), {":3: <model>", "'name' is missing"}},
      {"NameTwice",
       world("<model name='a'><link name='l'/></model>\n<model name='a'><link name='l'/></model>"),
       {":4: <model", "'a' must be unique", "line 3"}},
      {"NameOfModelAndFrame",
       world("<frame name='a'/>\n<model name='a'><link name='l'/></model>"),
       {"'a' must be unique"}},
      {"NameReserved", world("<model name='world'><link name='l'/></model>"), {"must not be 'world'"}},
      {"NameScoped", world("<model name='a::b'><link name='l'/></model>"), {"contain '::'"}},
      {"LinkTwice", world("<model name='a'><link name='l'/><link name='l'/></model>"), {"<model", "[l]"}},
      {"NoLink", world("<model name='a'/>"), {"model 'a'", "at least one link"}},
      {"PoseNan",
       box("", "<pose>0 nan 0 0 0 0</pose>"),
       {":4: <pose> of <model name='m'>", "'nan' must be finite"}},
      {"PoseInfinite", box("", "<pose>0 0 inf 0 0 0</pose>"), {"<pose>", "'inf' must be finite"}},
      {"PoseShort", box("", "<pose>0 0 0 0 0</pose>"), {"<pose>", "5 numbers must be 6"}},
      {"PoseWord", box("", "<pose>0 0 up 0 0 0</pose>"), {"<pose>", "'up' is not a number"}},
      {"PoseOfLinkNan", box("<pose>nan 0 0 0 0 0</pose>"), {"<pose> of <link name='l'>", "finite"}},
      {"PoseOutOfRange", box("", "<pose>0 1e40 0 0 0 0</pose>"), {"position y", "64-bit range"}, kOutOfRange},
      {"QuaternionLong",
       box("", "<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 1.5</pose>"),
       {"<pose>", "norm 1.5", "1 within 0.001"}},
      {"QuaternionShort",
       box("", "<pose rotation_format='quat_xyzw'>0 0 0 0 0 0</pose>"),
       {"<pose>", "must be 7"}},
      {"RotationFormat",
       box("", "<pose rotation_format='matrix'>0 0 0 0 0 0</pose>"),
       {"'matrix'", "euler_rpy"}},
      {"FrameUnknown",
       box("", "<pose relative_to='nowhere'>0 0 0 0 0 0</pose>"),
       {"<model", "no frame 'nowhere'"}},
      {"FrameInModelUnknown",
       world("<frame name='f'><pose relative_to='m::x'/></frame><model name='m'><link name='l'/></model>"),
       {"<frame name='f'>", "no frame 'm::x'"}},
      {"FrameCircle",
       world("<frame name='a' attached_to='b'/><frame name='b' attached_to='a'/>"),
       {"relative to itself"}},
      {"FrameOfLinkUnknown", box("<pose relative_to='nowhere'>0 0 0 0 0 0</pose>"), {"model 'm'", "nowhere"}},
      {"PlacementFrameUnknown",
       world("<model name='m' placement_frame='nowhere'><link name='l'/></model>"),
       {"placement frame 'nowhere'"}},
  };
}

std::vector<Row> physics_rows() {
  return {
      {"BoxZero", model("<box><size>1 0 1</size></box>"), {":7: <size> of <collision name='c'>", "0.0001 m"}},
      {"BoxNegative", model("<box><size>1 1 -1</size></box>"), {"<size>", "-1 m must be at least 0.0001 m"}},
      {"BoxWord", model("<box><size>1 big 1</size></box>"), {"<size>", "'big' is not a number"}},
      {"BoxShort", model("<box><size>1 1</size></box>"), {"model 'm'", "size"}},
      {"SphereNan", model("<sphere><radius>nan</radius></sphere>"), {"<radius>", "finite"}},
      {"SphereHuge", model("<sphere><radius>1e30</radius></sphere>"), {"<radius>", "at most 1e+08 m"}},
      {"CylinderZero",
       model("<cylinder><radius>1</radius><length>0</length></cylinder>"),
       {"<length>", "0.0001 m"}},
      {"EllipsoidZero", model("<ellipsoid><radii>1 1 0</radii></ellipsoid>"), {"<radii>", "0.0001 m"}},
      {"MeshUnknown",
       model("<mesh><uri>no_such.obj</uri></mesh>"),
       {"<uri>", "'no_such.obj' was not found"},
       kNotFound},
      {"MeshOfModelUnknown",
       model("<mesh><uri>model://no/such.stl</uri></mesh>"),
       {"<uri>", "searched", "models/no/such.stl"},
       kNotFound},
      {"MeshRemote",
       model("<mesh><uri>https://example.org/a.obj</uri></mesh>"),
       {"<uri>", "only file://, model:// and package://"}},
      {"MeshNoUri", model("<mesh/>"), {"<mesh>", "<uri> is missing"}},
      {"MeshBroken", model("<mesh><uri>broken.stl</uri></mesh>"), {"link 'l'", "broken.stl"}},
      {"MeshIndexNoNumber",
       model("<mesh><uri>index.dae</uri></mesh>"),
       {"index.dae:2: <p>", "indices must be integers"}},
      {"MeshNoTriangles", model("<mesh><uri>empty.obj</uri></mesh>"), {"link 'l'", "empty.obj"}},
      {"SubmeshUnknown",
       model("<mesh><uri>tetra.obj</uri><submesh><name>x</name></submesh></mesh>"),
       {"no submesh 'x'"},
       kNotFound},
      {"MeshScaleZero",
       model("<mesh><uri>tetra.obj</uri><scale>1 0 1</scale></mesh>"),
       {"scale 1 0 1", "not 0"}},
      {"DynamicPlane", model("<plane><normal>0 0 1</normal></plane>"), {"'m::l'", "plane", "static body"}},
      {"DynamicHuge", model("<box><size>200 1 1</size></box>"), {"'m::l'", "200", "L = 128 m"}},
      {"MassNegative", box(mass("-3")), {"<mass>", "mass = -3 kg must be at least 1e-06 kg"}},
      {"MassNan", box(mass("nan")), {"<mass>", "finite"}},
      {"MassWord", box(mass("heavy")), {"<mass>", "'heavy'"}},
      {"InertiaNan",
       box("<inertial><inertia><ixx>nan</ixx></inertia></inertial>"),
       {"<ixx> of <link name='l'>", "'nan' must be finite"}},
      {"FrictionNan",
       model("<box/>", "", "", "<surface><friction><ode><mu>nan</mu></ode></friction></surface>"),
       {"<mu>", "finite"}},
      {"Restitution",
       model("<box/>", "", "",
             "<surface><bounce><restitution_coefficient>2</restitution_coefficient></bounce></surface>"),
       {"model 'm'", "[2]", "maximum allowed value of [1]", "[restitution_coefficient]"}},
      {"Damping",
       box("<velocity_decay><linear>3</linear></velocity_decay>"),
       {"'m::l'", "linear damping = 3", "at most 1"}},
      {"StepZero",
       world("<physics type='x'><max_step_size>0</max_step_size></physics>"),
       {"time_step = 0 s", "1e-05 s"}},
      {"StepWord",
       world("<physics type='x'><max_step_size>soon</max_step_size></physics>"),
       {"<max_step_size>", "'soon'"}},
      {"GravityNan", world("<gravity>0 0 nan</gravity>"), {"<gravity>", "finite"}},
      {"GravityShort", world("<gravity>0 -9.8</gravity>"), {"<gravity>", "3 numbers"}},
      {"GravityTwice", world("<gravity>0 0 0</gravity><gravity>0 0 1</gravity>"), {"<gravity>", "only once"}},
      {"FieldCount",
       model("<tessera:heightfield columns='2' rows='2' spacing='1 1'>0 0 0</tessera:heightfield>"),
       {"3 heights", "2 x 2 = 4"}},
      {"FieldSpacing",
       model("<tessera:heightfield columns='2' rows='2' spacing='1'>0 0 0 0</tessera:heightfield>"),
       {"spacing", "2 numbers"}},
      {"FieldMoves",
       model("<tessera:heightfield columns='2' rows='2' spacing='1 1'>0 0 0 0</tessera:heightfield>"),
       {"'m::l'", "height field", "static"}},
      {"GroundSource",
       model("<tessera:ground source='moon'/>"),
       {"source 'moon'", "plain, planet or folder"}},
      {"GroundAttribute",
       model("<tessera:ground source='plain' colour='green'/>"),
       {"<tessera:ground>", "unknown attribute 'colour'"}},
      {"GroundHeight", model("<tessera:ground source='plain' spacing='8'/>"), {"<tessera:ground>", "height"}},
      {"GroundSea",
       model("<tessera:ground source='plain' spacing='8' height='9' wavelength='100' sea='blue'/>"),
       {"sea 'blue'", "true or false"}},
      {"GroundOctaves",
       model("<tessera:ground source='plain' spacing='8' height='9' wavelength='100' octaves='40'/>"),
       {"octaves = 40", "1 to 24"}},
      {"GroundWavelength",
       model("<tessera:ground source='plain' spacing='8' height='9' wavelength='100' octaves='5'/>", "",
             "<static>true</static>"),
       {"wavelength = 100 m", "at least 256 m"}},
      {"GroundRadius",
       model("<tessera:ground source='planet' radius='20' spacing='8' height='1' wavelength='100'/>", "",
             "<static>true</static>"),
       {"radius = 20 m", "at least 64 m"}},
      {"GroundSpacing",
       model("<tessera:ground source='plain' spacing='0.5' height='1' wavelength='100'/>", "",
             "<static>true</static>"),
       {"'m::l'", "spacing = 0.5 m", "at least 2 m"}},
      {"GroundMoves",
       model("<tessera:ground source='plain' spacing='8' height='1' wavelength='100'/>"),
       {"'m::l'", "ground", "static"}},
  };
}

std::vector<Row> tessera_rows() {
  const std::string site = "<tessera:site name='s' latitude='52' longitude='4'";
  return {
      {"Element", world("<tessera:magic/>"), {"<tessera:magic>", "unknown or misplaced"}},
      {"ElementOfModel", box("", "<tessera:magic/>"), {"<tessera:magic>", "unknown or misplaced"}},
      {"ElementOfLink",
       box("<tessera:sector>1 2 3</tessera:sector>"),
       {"<tessera:sector>", "unknown or misplaced"}},
      {"Attribute",
       world("<model name='m' tessera:colour='red'><link name='l'/></model>"),
       {"<model", "tessera:colour"}},
      {"Setting", settings("<magic>1</magic>"), {"<magic>", "unknown setting"}},
      {"SettingOfTheWorld",
       settings("<tessera:frame name='f'/>"),
       {"<tessera:frame name='f'>", "belongs into the <world>"}},
      {"SettingOfThePast", settings("<island_cap>100</island_cap>"), {"<island_cap>", "unknown setting"}},
      {"SectorSizeFloat",
       settings("<sector_size>1024</sector_size>"),
       {"sector_size = 1024 m", "788.27", "f64"}},
      {"SectorSizeZero", settings("<sector_size>0</sector_size>"), {"sector_size = 0 m", "0.5 m"}},
      {"SectorSizeWord", settings("<sector_size>large</sector_size>"), {"<sector_size>", "'large'"}},
      {"Precision", settings("<precision>f16</precision>"), {"<precision>", "'f16' must be f32 or f64"}},
      {"Seams", settings("<seams>glue</seams>"), {"<seams>", "'glue' must be island or clone"}},
      {"CloneDepth", settings("<clone_depth>99</clone_depth>"), {"clone_depth = 99", "at most 8"}},
      {"CloneDepthFraction",
       settings("<clone_depth>1.5</clone_depth>"),
       {"<clone_depth>", "'1.5' must be an integer of 0 to 8"}},
      {"Iterations",
       settings("<solver_iterations>1e9</solver_iterations>"),
       {"solver_iterations", "at most 1000"}},
      {"Flag",
       settings("<continuous_collision>maybe</continuous_collision>"),
       {"<continuous_collision>", "true or false"}},
      {"SleepAfter", settings("<sleep_after>-1</sleep_after>"), {"sleep_after = -1 s", "at least 0"}},
      {"PlanetIncomplete",
       world("<tessera:central_gravity surface='9.8'/>"),
       {"<tessera:central_gravity>", "'radius' is missing"}},
      {"PlanetRadius",
       world("<tessera:central_gravity surface='9.8' radius='-1'/>"),
       {"radius = -1 m", "at least"}},
      {"PlanetAttribute",
       world("<tessera:central_gravity surface='9.8' radius='1' mass='1'/>"),
       {"unknown attribute 'mass'"}},
      {"SiteLatitude",
       world("<tessera:site name='s' latitude='91' longitude='4'/>"),
       {"name='s'", "latitude = 91", "-90 to 90"}},
      {"SiteLongitude",
       world("<tessera:site name='s' latitude='9' longitude='400'/>"),
       {"longitude = 400", "-360 to 360"}},
      {"SiteIncomplete", world("<tessera:site name='s' latitude='9'/>"), {"'longitude' is missing"}},
      {"SiteHeight", world(site + " height='nan'/>"), {"name='s'", "finite"}},
      {"SiteFrame", world(site + " frame='flat'/>"), {"'flat' must be geodetic or geocentric"}},
      {"SiteAttribute", world(site + " up='z'/>"), {"unknown attribute 'up'"}},
      {"SiteChild",
       world(site + "><gravity>0 0 0</gravity></tessera:site>"),
       {"<gravity>", "not allowed in a <tessera:site>"}},
      {"SectorShort",
       world("<model name='m' tessera:sector='1 2'><link name='l'/></model>"),
       {"'1 2' must be 3 integers"}},
      {"SectorHuge",
       world("<model name='m' tessera:sector='1 2 9223372036854775808'><link name='l'/></model>"),
       {"<model", "2^63"}},
      {"SectorLeaves",
       world("<model name='m' tessera:sector='9223372036854775807 0 0'><pose>200 0 0 0 0 0</pose><link "
             "name='l'/></model>"),
       {"<model name='m'>", "component i", "64-bit range"},
       kOutOfRange},
      {"VelocityStatic",
       box("", "<static>true</static><tessera:velocity linear='1 0 0'/>"),
       {},
       absl::StatusCode::kOk},
      {"VelocityNan", box("", "<tessera:velocity linear='nan 0 0'/>"), {"<tessera:velocity>", "finite"}},
      {"VelocityAttribute", box("", "<tessera:velocity lineal='1 0 0'/>"), {"unknown attribute 'lineal'"}},
      {"ShuffleNegative", settings("<shuffle>-1</shuffle>"), {"<shuffle>", "'-1'", "integer of 0"}},
      {"ShuffleWord", settings("<shuffle>often</shuffle>"), {"<shuffle>", "'often'", "integer of 0"}},
      {"DriveMode",
       joint("<tessera:drive mode='fast'/>"),
       {"<tessera:drive> of <joint name='j'>", "mode 'fast'"}},
      {"JointType",
       world("<model name='m'><link name='a'/><link name='b'/>\n<joint name='j' type='revolut'>"
             "<parent>a</parent><child>b</child></joint></model>"),
       {"<joint name='j'>", "type='revolut' is none of ball,", "the nearest is revolute"}},
      {"DriveWithoutMode", joint("<tessera:drive target='1'/>"), {"<tessera:drive>", "'mode' is missing"}},
      {"DriveAxis", joint("<tessera:drive mode='free' axis='3'/>"), {"axis '3' must be 1 or 2"}},
      {"DriveTwice",
       joint("<tessera:drive mode='free'/><tessera:drive mode='effort' target='1'/>"),
       {"<tessera:drive> of <joint name='j'>", "axis 1 has a drive already"}},
      {"DriveNan", joint("<tessera:drive mode='effort' target='nan'/>"), {"<tessera:drive>", "finite"}},
      {"DriveAttribute", joint("<tessera:drive mode='free' speed='1'/>"), {"unknown attribute 'speed'"}},
      {"ArmatureOfNoAxis", joint("<tessera:armature value='1' axis='2'/>"), {"joint 'j'", "no axis 2"}},
      {"ArmatureTwice",
       joint("<tessera:armature value='1'/><tessera:armature value='1'/>"),
       {"<tessera:armature> of <joint name='j'>", "axis 1 has an armature already"}},
      {"ArmatureNegative", joint("<tessera:armature value='-1'/>"), {"joint 'm::j'", "armature = -1 kg m^2"}},
      {"ArmatureWord", joint("<tessera:armature value='much'/>"), {"<tessera:armature>", "'much'"}},
      {"ArmatureWithoutValue", joint("<tessera:armature/>"), {"<tessera:armature>", "'value' is missing"}},
      {"DriveOfNoAxis",
       joint("<tessera:drive mode='velocity' axis='2'/>"),
       {"joint 'm::j'", "drive of axis 2 must be free"}},
      {"DriveBeyondHalfATurn", joint("<tessera:drive mode='position' target='4'/>"), {"position = 4 rad"}},
      {"ElementOfJoint", joint("<tessera:motor/>"), {"<tessera:motor>", "unknown or misplaced"}},
      {"VelocityLarge", box("", "<tessera:velocity linear='1e9 0 0'/>"), {"'m::l'", "1e+06 m/s"}},
  };
}

std::vector<Row> include_rows() {
  return {
      {"UriMissing", include(""), {"<include>", "<uri> is missing"}},
      {"UriEmpty", include("<uri></uri>"), {"<uri>", "empty"}},
      {"NotFound", include("<uri>no_such.sdf</uri>"), {"<uri>", "'no_such.sdf' was not found"}, kNotFound},
      {"ModelNotFound",
       include("<uri>model://no_such</uri>"),
       {"'model://no_such' was not found", "models/no_such.sdf",
        "set TESSERA_MODEL_PATH, GZ_SIM_RESOURCE_PATH"},
       kNotFound},
      {"ModelOutside",
       include("<uri>model://../../etc</uri>"),
       {"<uri>", "'model://../../etc'", "must not leave the folders of models"}},
      {"ModelOutsideInTheEnd", include("<uri>model://a/../../etc</uri>"), {"must not leave"}},
      {"ModelAbsolute", include("<uri>model:////etc/passwd</uri>"), {"must not leave"}},
      {"PackageOutside", model("<mesh><uri>package://../a.obj</uri></mesh>"), {"<uri>", "must not leave"}},
      {"ConfigOutside",
       include("<uri>outside</uri>"),
       {"<sdf>", "'../good.sdf' must be a file in the model's folder"}},
      {"Scheme", include("<uri>ftp://a/b.sdf</uri>"), {"only file://, model:// and package://"}},
      {"NoModel", include("<uri>world.sdf</uri>"), {"world.sdf", "must hold a <model>"}},
      {"NoSdf", include("<uri>tetra.obj</uri>"), {"tetra.obj", "malformed XML"}},
      {"Child",
       include("<uri>good.sdf</uri><colour>red</colour>"),
       {"<colour>", "unknown element in an <include>"}},
      {"Merge",
       world("<include merge='true'><uri>good.sdf</uri></include>"),
       {"merge='true' is for an <include> in a <model>"}},
      {"Itself", include("<uri>itself.sdf</uri>"), {"itself.sdf", "includes itself"}},
      {"TooDeep", include("<uri>deep_0.sdf</uri>"), {"nested deeper than 16"}},
      {"TooLarge", include("<uri>bomb_0.sdf</uri>"), {"bomb", "all nested includes together"}},
      {"Pose", include("<uri>good.sdf</uri><pose>0 0 nan 0 0 0</pose>"), {"<pose>", "finite"}},
      {"Static", include("<uri>good.sdf</uri><static>perhaps</static>"), {"<static>", "true or false"}},
      {"Twice",
       world("<include><uri>good.sdf</uri></include><include><uri>good.sdf</uri></include>"),
       {"'good' must be unique"}},
  };
}

std::vector<Row> urdf_rows() {
  const std::string child =
      "<joint name='j' type='fixed'><parent link='base'/><child link='tip'/></joint><link name='tip'>";
  return {
      {"InertiaNan",
       urdf(child + "<inertial><mass value='1'/><inertia ixx='nan'/></inertial></link>"),
       {"<inertia> of <link name='tip'>", "finite"}},
      {"MassNegative",
       "<robot name='r'><link name='l'><inertial><mass value='-1'/></inertial></link></robot>",
       {"<link name='l'>", "mass = -1 kg"}},
      {"MassWord", urdf(child + "<inertial><mass value='heavy'/></inertial></link>"), {"<mass>", "'heavy'"}},
      {"JointUnknown",
       urdf("<joint name='j' type='rubber'><parent link='base'/><child link='tip'/></joint><link "
            "name='tip'/>"),
       {"<robot name='r'>", "rubber"}},
      {"JointDangling",
       urdf("<joint name='j' type='fixed'><parent link='base'/><child link='nobody'/></joint>"),
       {"<robot name='r'>", "nobody"}},
      {"NoLinks", "<robot name='r'/>", {"<robot name='r'>"}},
      {"MeshUnknown",
       "<robot name='r'><link name='l'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' "
       "iyz='0' izz='1'/></inertial><collision><geometry><mesh "
       "filename='no_such.stl'/></geometry></collision></link></robot>",
       {"no_such.stl", "not found"},
       kNotFound},
  };
}

std::vector<Row> joint_rows() {
  return {
      {"DampingNegative",
       joint("", "<dynamics><damping>-1</damping></dynamics>"),
       {"joint 'm::j': axis 1", "damping = -1"}},
      {"LinkUnknown",
       world("<model name='m'><link name='a'/><joint name='j' type='fixed'><parent>a</parent><child>z</child>"
             "</joint></model>"),
       {"model 'm'", "[z]"}},
      {"PitchZero",
       world("<model name='m'><link name='a'/><link name='b'/><joint name='j' type='screw'><parent>a</parent>"
             "<child>b</child><axis><xyz>0 0 1</xyz></axis><screw_thread_pitch>0</screw_thread_pitch></joint>"
             "</model>"),
       {"joint 'j'", "thread pitch must be finite and not 0"}},
      {"PitchWord",
       joint("<screw_thread_pitch>fine</screw_thread_pitch>"),
       {"<screw_thread_pitch> of <joint name='j'>", "'fine'"}},
  };
}

class BadFile : public testing::TestWithParam<Row> {
 protected:
  static void SetUpTestSuite() {
    // Each case may run in a process of its own, at the same time as others.
    folder_ = new std::filesystem::path(std::filesystem::path(testing::TempDir()) /
                                        absl::StrCat("tessera_bad_files_", getpid()));
    std::filesystem::create_directories(*folder_);
    const auto write = [](const std::string& name, const std::string& text) {
      std::ofstream(*folder_ / name) << text;
    };
    const std::string link =
        "<link name='l'><collision name='c'><geometry><box/></geometry></collision></link>";
    const auto model_file = [&](const std::string& name, const std::string& body) {
      return absl::StrCat("<sdf version='1.9'><model name='", name, "'>", body, "</model></sdf>");
    };
    const auto child = [](const std::string& file, const std::string& name) {
      return absl::StrCat("<include><uri>", file, "</uri><name>", name, "</name></include>");
    };
    std::filesystem::create_directories(*folder_ / "outside");
    write("outside/model.config", "<model><sdf version='1.9'>../good.sdf</sdf></model>");
    write("good.sdf", model_file("good", link));
    write("world.sdf", "<sdf version='1.9'><world name='w'/></sdf>");
    write("itself.sdf", model_file("itself", link + child("itself.sdf", "again")));
    for (int n = 0; n <= kIncludeDepthMax; ++n) {
      const std::string next = absl::StrCat("deep_", n + 1, ".sdf");
      write(absl::StrCat("deep_", n, ".sdf"), model_file("deep", link + child(next, "next")));
    }
    write(absl::StrCat("deep_", kIncludeDepthMax + 1, ".sdf"), model_file("deep", link));
    // Each holds the next one forty times: 40^8 models, were they all to be made.
    for (int n = 0; n < 8; ++n) {
      std::string body = link;
      for (int copy = 0; copy < 40; ++copy) {
        body += child(absl::StrCat("bomb_", n + 1, ".sdf"), absl::StrCat("copy_", copy));
      }
      write(absl::StrCat("bomb_", n, ".sdf"), model_file("bomb", body));
    }
    write("bomb_8.sdf", model_file("bomb", link));
    write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n");
    write("empty.obj", "# nothing\n");
    write("broken.stl", "this is no mesh");
    write("index.dae", "<COLLADA><mesh>\n<triangles count='1'><p>0]1 2</p></triangles></mesh></COLLADA>");
  }
  static void TearDownTestSuite() {
    std::filesystem::remove_all(*folder_);
    delete folder_;
  }

  static std::filesystem::path* folder_;
};

std::filesystem::path* BadFile::folder_ = nullptr;

TEST_P(BadFile, IsRefused) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(GetParam().xml, *folder_);
  EXPECT_EQ(loaded.status().code(), GetParam().code) << loaded.status();
  for (const std::string& part : GetParam().said) {
    EXPECT_THAT(std::string(loaded.status().message()), HasSubstr(part));
  }
}

std::string row_name(const testing::TestParamInfo<Row>& row) { return row.param.name; }

INSTANTIATE_TEST_SUITE_P(Xml, BadFile, testing::ValuesIn(xml_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Placement, BadFile, testing::ValuesIn(placement_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Physics, BadFile, testing::ValuesIn(physics_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Joints, BadFile, testing::ValuesIn(joint_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Tessera, BadFile, testing::ValuesIn(tessera_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Include, BadFile, testing::ValuesIn(include_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Urdf, BadFile, testing::ValuesIn(urdf_rows()), row_name);

TEST(BadFiles, MalformedXmlIsToldInBoundedOwnWords) {
  const std::string message(
      load_world_string(absl::StrCat("<", std::string(100'000, 'n'), "></sdf>"), "").status().message());
  EXPECT_THAT(message, HasSubstr("nnn...> is not closed"));
  EXPECT_LT(message.size(), 200u);
  EXPECT_EQ(message.find("XML_ERROR"), std::string::npos);
}

TEST(BadFiles, MissingFile) {
  const auto loaded = load_world_file("/no/such/world.sdf");
  EXPECT_EQ(loaded.status().code(), kNotFound);
  EXPECT_THAT(std::string(loaded.status().message()), HasSubstr("/no/such/world.sdf"));
}

TEST(BadFiles, Folder) { EXPECT_EQ(load_world_file(testing::TempDir()).status().code(), kNotFound); }

TEST(BadFiles, HugeFile) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / absl::StrCat("tessera_huge_", getpid(), ".sdf");
  std::ofstream(file) << "<sdf/>";
  std::filesystem::resize_file(file, kWorldFileBytesMax + 1);  // a hole: takes no place on the disk
  const auto loaded = load_world_file(file);
  std::filesystem::remove(file);
  EXPECT_EQ(loaded.status().code(), kInvalid);
  EXPECT_THAT(std::string(loaded.status().message()), HasSubstr("at most 512 MiB"));
}

}  // namespace
}  // namespace tessera
