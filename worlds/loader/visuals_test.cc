// What bodies look like: visuals in the place of collisions.
#include "worlds/loader/visuals.h"

#include <gmock/gmock.h>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Looks looks_of(const std::string& text, const Folder& folder) {
  folder.write("world.sdf", text);
  absl::StatusOr<Looks> looks = load_looks(static_cast<const std::filesystem::path&>(folder) / "world.sdf");
  EXPECT_TRUE(looks.ok()) << looks.status();
  return looks.ok() ? *std::move(looks) : Looks{};
}

const Look& look_of(const Looks& looks, const std::string& body) {
  const auto found = looks.bodies.find(body);
  EXPECT_NE(found, looks.bodies.end()) << body;
  static const Look none;
  return found == looks.bodies.end() ? none : *found->second;
}

std::string visual(const std::string& name, const std::string& geometry, const std::string& more = "") {
  return absl::StrCat("<visual name='", name, "'>", more, "<geometry>", geometry, "</geometry></visual>");
}

std::string diffuse(const std::string& colour) {
  return absl::StrCat("<material><diffuse>", colour, "</diffuse></material>");
}

TEST(Visuals, AreShapesWithColoursInTheFrameOfTheLink) {
  const Folder folder;
  const Looks looks =
      looks_of(world(model("a", "",
                           kUnitBox +
                               visual("v", "<sphere><radius>0.5</radius></sphere>",
                                      "<pose>1 2 3 0 0 0</pose>" + diffuse("1 0.5 0 1")) +
                               visual("w", "<box><size>1 2 3</size></box>",
                                      "<material><script><name>Gazebo/Red</name></script></material>") +
                               visual("plain", "<box><size>1 1 1</size></box>")) +
                     model("b", "", kUnitBox)),
               folder);
  EXPECT_EQ(looks.world, "w");
  const Look& look = look_of(looks, "a::l");
  EXPECT_THAT(look.colours, ElementsAre(0xff8000, 0xff0000, 0xb3b3b3));
  ASSERT_THAT(look.shape.parts, SizeIs(3));
  EXPECT_EQ(std::get<Sphere>(look.shape.parts[0].geometry).radius, 0.5);
  expect_near(look.shape.parts[0].pose.position, {1, 2, 3});
  EXPECT_EQ(std::get<Box>(look.shape.parts[1].geometry).size, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(looks.bodies.contains("b::l")) << "it is shown by its collision";
}

TEST(Visuals, OfMeshesHaveTheColoursOfTheirMaterials) {
  const Folder folder;
  folder.write("paint.mtl", "newmtl sky\nKd 0 0 1\nnewmtl leaf\nKd 0 1 0\n");
  folder.write("mesh.obj",
               "mtllib paint.mtl\no one\nusemtl sky\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
               "o two\nusemtl leaf\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 4 5 6\n");
  const std::string mesh = "<mesh><uri>mesh.obj</uri><scale>2 2 2</scale></mesh>";
  const Looks looks = looks_of(world(model("own", "", kUnitBox + visual("v", mesh)) +
                                     model("given", "", kUnitBox + visual("v", mesh, diffuse("1 1 1")))),
                               folder);
  const Look& own = look_of(looks, "own::l");
  EXPECT_THAT(own.colours, ElementsAre(0x0000ff, 0x00ff00));
  ASSERT_THAT(own.shape.parts, SizeIs(2));
  EXPECT_EQ(std::get<TriangleMesh>(own.shape.parts[0].geometry).vertices[1], Eigen::Vector3d(2, 0, 0));
  EXPECT_THAT(look_of(looks, "given::l").colours, ElementsAre(0xffffff, 0xffffff));
}

TEST(Visuals, ThatCannotBeShownAreLeftOut) {
  const Folder folder;
  const std::string unseen = visual("w", "<box><size>1 1 1</size></box>", "<transparency>1</transparency>");
  EXPECT_THAT(looks_of(world(model("a", "", kUnitBox + unseen)), folder).bodies, IsEmpty());
  const Looks looks = looks_of(
      world(model("a", "",
                  kUnitBox + visual("v", "<mesh><uri>not_there.dae</uri></mesh>") +
                      visual("u", "<sphere><radius>1</radius></sphere>", diffuse("0 0 1")) + unseen)),
      folder);
  EXPECT_THAT(look_of(looks, "a::l").colours, ElementsAre(0xb3b3b3, 0x0000ff))
      << "its collision stands for the mesh";
}

TEST(Visuals, OfUrdfLinksThatAreFixedGoWithTheirParents) {
  const Folder folder;
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";
  const Looks looks = looks_of(
      "<robot name='r'><material name='steel'><color rgba='0.2 0.4 0.6 1'/></material>"
      "<link name='base'>" +
          inertial +
          "<visual><origin xyz='0 0 1'/><geometry><box size='1 1 1'/></geometry><material "
          "name='steel'/></visual>"
          "<collision><geometry><sphere radius='3'/></geometry></collision></link>"
          "<link name='head'>" +
          inertial +
          "<visual><geometry><cylinder radius='1' length='2'/></geometry>"
          "<material name=''><color rgba='1 1 0 1'/></material></visual></link>"
          "<joint name='neck' type='fixed'><parent link='base'/><child link='head'/><origin xyz='0 0 5'/>"
          "</joint></robot>",
      folder);
  const Look& look = look_of(looks, "r::base");
  EXPECT_THAT(look.colours, ElementsAre(0x336699, 0xffff00));
  ASSERT_THAT(look.shape.parts, SizeIs(2));
  expect_near(look.shape.parts[0].pose.position, {0, 0, 1});
  expect_near(look.shape.parts[1].pose.position, {0, 0, 5});
}

}  // namespace
}  // namespace tessera
