// What a world file says of bodies is what they are: shapes, masses, surfaces.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <variant>

#include "worlds/loader/model_file.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

// Shapes.

TEST(Shapes, OfEveryKind) {
  const LoadedWorld loaded = load(world(
      model("box", "", collision("<box><size>1 2 3</size></box>")) +
      model("sphere", "", collision("<sphere><radius>0.3</radius></sphere>")) +
      model("capsule", "", collision("<capsule><radius>0.2</radius><length>0.7</length></capsule>")) +
      model("cylinder", "", collision("<cylinder><radius>0.4</radius><length>0.9</length></cylinder>")) +
      model("ellipsoid", "", collision("<ellipsoid><radii>0.1 0.2 0.3</radii></ellipsoid>")) +
      model("plane", "<static>1</static>", collision("<plane><normal>0 3 4</normal></plane>"))));
  EXPECT_EQ(only_geometry<Box>(loaded, body_named(loaded, "box::l")).size, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(only_geometry<Sphere>(loaded, body_named(loaded, "sphere::l")).radius, 0.3);
  EXPECT_EQ(only_geometry<Capsule>(loaded, body_named(loaded, "capsule::l")).length, 0.7);
  EXPECT_EQ(only_geometry<Cylinder>(loaded, body_named(loaded, "cylinder::l")).radius, 0.4);
  EXPECT_EQ(only_geometry<Ellipsoid>(loaded, body_named(loaded, "ellipsoid::l")).radii,
            Eigen::Vector3d(0.1, 0.2, 0.3));
  expect_near(only_geometry<Plane>(loaded, body_named(loaded, "plane::l")).normal, {0, 0.6, 0.8});
  EXPECT_THAT(loaded.notices, IsEmpty());
}

TEST(Shapes, EqualOnesAreShared) {
  const std::string spot = "<pose>0 0 1 0 0 0</pose>";
  const LoadedWorld loaded =
      load(world(model("a", "") + model("b", spot) + model("c", "<static>true</static>") +
                 model("d", spot, collision("<sphere><radius>1</radius></sphere>"))));
  EXPECT_EQ(loaded.world.bodies.size(), 4u);
  EXPECT_EQ(loaded.world.shapes.size(), 2u);
}

TEST(Shapes, CompoundWithPoses) {
  const LoadedWorld loaded =
      load(world(model("m", "",
                       "<collision name='a'><pose>0 0 1 0 0 0</pose><geometry><box><size>1 1 "
                       "1</size></box></geometry></collision>"
                       "<collision name='b'><pose>0 0 -1 1.5707963267948966 0 "
                       "0</pose><geometry><sphere><radius>1</radius></sphere>"
                       "</geometry></collision>")));
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::l"));
  ASSERT_EQ(shape.parts.size(), 2u);
  EXPECT_EQ(shape.parts[0].pose.position, Eigen::Vector3d(0, 0, 1));
  expect_near(shape.parts[1].pose.orientation * Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ());
}

TEST(Shapes, MeshOfABodyThatMovesIsAHullForEachObject) {
  const Folder folder;
  folder.write("t.obj", kTetrahedra);
  const LoadedWorld loaded =
      load(world(model("m", "", collision("<mesh><uri>t.obj</uri><scale>2 2 2</scale></mesh>"))), folder);
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::l"));
  ASSERT_EQ(shape.parts.size(), 2u);
  const auto& hull = std::get<ConvexHull>(shape.parts[1].geometry);
  EXPECT_EQ(hull.points.size(), 4u);
  EXPECT_THAT(hull.points, Contains(Eigen::Vector3d(12, 0, 0)));
}

TEST(Shapes, MeshOfAStaticBodyIsASurface) {
  const Folder folder;
  folder.write("t.obj", kTetrahedra);
  const LoadedWorld loaded =
      load(world(model("m", "<static>true</static>", collision("<mesh><uri>t.obj</uri></mesh>"))), folder);
  const auto mesh = only_geometry<TriangleMesh>(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.indices.size(), 24u);
}

TEST(Shapes, SubmeshCentred) {
  const Folder folder;
  folder.write("t.obj", kTetrahedra);
  const LoadedWorld loaded =
      load(world(model("m", "",
                       collision("<mesh><uri>file://t.obj</uri><submesh><name>two</name><center>true</center>"
                                 "</submesh></mesh>"))),
           folder);
  const auto hull = only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l"));
  EXPECT_THAT(hull.points, Contains(Eigen::Vector3d(-0.5, -0.5, -0.5)));
}

// COLLADA has ids beside names, and nodes without a name of their own.
TEST(Shapes, SubmeshOfACollada) {
  const auto triangle = [](const std::string& name, const char* x) {
    return absl::StrCat(
        "<geometry id='geom-", name, "' name='", name, "'><mesh><source id='p-", name,
        "'><float_array id='a-", name, "' count='12'>", x, " 0 0 0 1 0 0 0 1 0 0 0</float_array>",
        "<technique_common><accessor source='#a-", name,
        "' count='4' stride='3'><param name='X' type='float'/><param name='Y' type='float'/>"
        "<param name='Z' type='float'/></accessor></technique_common></source><vertices id='v-",
        name, "'><input semantic='POSITION' source='#p-", name,
        "'/></vertices><triangles count='4'><input semantic='VERTEX' source='#v-", name,
        "' offset='0'/><p>0 1 2 0 1 3 0 2 3 1 2 3</p></triangles></mesh></geometry>");
  };
  const auto node = [](const std::string& id, const std::string& name, const std::string& geometry) {
    return absl::StrCat("<node id='", id, "' name='", name, "'><node><instance_geometry url='#geom-",
                        geometry, "'/></node></node>");
  };
  const Folder folder;
  folder.write(
      "c.dae",
      absl::StrCat("<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' "
                   "version='1.4.1'><asset><unit meter='1'/><up_axis>Z_UP</up_axis></asset>"
                   "<library_geometries>",
                   triangle("small", "1"), triangle("large", "5"),
                   "</library_geometries><library_visual_scenes><visual_scene id='s'>",
                   node("node-a", "Wheel", "small"), node("node-b", "Door", "large"),
                   "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#s'/>"
                   "</scene></COLLADA>"));
  for (const char* name : {"Door", "large"}) {
    const LoadedWorld loaded =
        load(world(model("m", "",
                         collision(absl::StrCat("<mesh><uri>c.dae</uri><submesh><name>", name,
                                                "</name></submesh></mesh>")))),
             folder);
    const auto hull = only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l"));
    EXPECT_THAT(hull.points, Contains(Eigen::Vector3d(5, 0, 0))) << name;
  }
}

TEST(Shapes, StlMesh) {
  const Folder folder;
  folder.write(
      "t.stl",
      "solid t\n"
      "facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n"
      "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
      "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\n"
      "endsolid t\n");
  const LoadedWorld loaded = load(world(model("m", "", collision("<mesh><uri>t.stl</uri></mesh>"))), folder);
  EXPECT_EQ(only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l")).points.size(), 4u);
}

TEST(Shapes, HeightField) {
  const LoadedWorld loaded = load(world(model(
      "m", "<static>true</static>",
      collision(
          "<tessera:heightfield columns='3' rows='2' spacing='0.5 2'>0 1 2\n3 4 5</tessera:heightfield>"))));
  const auto field = only_geometry<HeightField>(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(field.columns, 3u);
  EXPECT_EQ(field.rows, 2u);
  EXPECT_EQ(field.spacing, Eigen::Vector2d(0.5, 2));
  EXPECT_THAT(field.heights, ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(Shapes, Ground) {
  const LoadedWorld loaded = load(world(model(
      "m", "<static>true</static>",
      collision("<tessera:ground source='planet' radius='6e6' spacing='16' height='900' wavelength='4000' "
                "octaves='7' seed='3' sea='true'/>"))));
  EXPECT_EQ(only_geometry<Ground>(loaded, body_named(loaded, "m::l")),
            (Ground{.source = Ground::Source::kPlanet,
                    .spacing = 16,
                    .radius = 6e6,
                    .height = 900,
                    .wavelength = 4000,
                    .octaves = 7,
                    .seed = 3,
                    .has_sea = true}));
}

TEST(Shapes, GroundOfFiles) {
  std::string name = (std::filesystem::temp_directory_path() / "groundXXXXXX").string();
  const std::filesystem::path folder = mkdtemp(name.data());
  std::filesystem::create_directory(folder / "tiles");
  std::ofstream(folder / "tiles/a.obj") << "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n";
  const std::string text = world(
      model("m", "<static>true</static>", collision("<tessera:ground source='folder' folder='tiles'/>")));
  const LoadedWorld loaded = load(text, folder);
  const auto ground = only_geometry<Ground>(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(ground.folder, folder / "tiles");
  EXPECT_NE(ground.checksum, 0u);
  std::ofstream(folder / "tiles/a.obj") << "v 0 0 0\nv 9 0 0\nv 0 9 1\nf 1 2 3\n";
  const LoadedWorld changed = load(text, folder);
  EXPECT_NE(only_geometry<Ground>(changed, body_named(changed, "m::l")).checksum, ground.checksum);
  std::filesystem::remove_all(folder);
  EXPECT_THAT(std::string(load_world_string(text, folder).status().message()), testing::HasSubstr("tiles"));
}

// Bodies.

TEST(Bodies, StaticDynamicKinematic) {
  const LoadedWorld loaded = load(world(model("s", "<static>true</static>") + model("d", "") +
                                        model("k", "", "<kinematic>true</kinematic>" + kUnitBox)));
  EXPECT_EQ(body_named(loaded, "s::l").properties.motion, Motion::kStatic);
  EXPECT_EQ(body_named(loaded, "d::l").properties.motion, Motion::kDynamic);
  EXPECT_EQ(body_named(loaded, "k::l").properties.motion, Motion::kKinematic);
}

TEST(Bodies, MassAndDiagonalInertiaStayAsTheyAre) {
  const LoadedWorld loaded =
      load(world(model("m", "",
                       "<inertial><pose>0.1 0.2 0.3 0 0 "
                       "1.5707963267948966</pose><mass>7</mass><inertia><ixx>3</ixx><iyy>1</iyy>"
                       "<izz>2.5</izz></inertia></inertial>" +
                           kUnitBox)));
  const BodyProperties& p = body_named(loaded, "m::l").properties;
  EXPECT_EQ(p.mass, 7);
  EXPECT_THAT(p.inertia, ElementsAre(3, 1, 2.5));
  EXPECT_THAT(p.centre, ElementsAre(0.1, 0.2, 0.3));
  EXPECT_NEAR(p.principal_axes[2], std::sqrt(0.5), 1e-12);
}

TEST(Bodies, FullTensorIsTurnedIntoPrincipalMoments) {
  const LoadedWorld loaded = load(world(model(
      "m", "",
      "<inertial><mass>2</mass><inertia><ixx>3</ixx><iyy>4</iyy><izz>5</izz><ixy>0.5</ixy><ixz>-0.2</ixz>"
      "<iyz>0.3</iyz></inertia></inertial>" +
          kUnitBox)));
  const BodyProperties& p = body_named(loaded, "m::l").properties;
  const Eigen::Matrix3d axes = centre_frame(p).orientation.toRotationMatrix();
  const Eigen::Matrix3d tensor =
      axes * Eigen::Vector3d(p.inertia[0], p.inertia[1], p.inertia[2]).asDiagonal() * axes.transpose();
  Eigen::Matrix3d expected;
  expected << 3, 0.5, -0.2, 0.5, 4, 0.3, -0.2, 0.3, 5;
  EXPECT_LT((tensor - expected).norm(), 1e-12);
}

TEST(Bodies, AutomaticInertiaOfNewerFiles) {
  const LoadedWorld loaded = load(world(
      model("m", "",
            "<inertial auto='true'/>" + collision("<box><size>1 2 3</size></box>", "<density>10</density>")),
      "1.11"));
  const BodyProperties& p = body_named(loaded, "m::l").properties;
  EXPECT_DOUBLE_EQ(p.mass, 60);
  EXPECT_DOUBLE_EQ(p.inertia[0], 60 * 13 / 12.0);
  EXPECT_THAT(loaded.notices, ElementsAre("1 x file in SDF 1.11, read as 1.9"));
}

// A tetrahedron of 1/6 m^3, also in a mirror and inside out; and one without its floor.
TEST(Bodies, AutomaticInertiaOfMeshFiles) {
  const Folder folder;
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  folder.write("solid.obj", corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  folder.write("inside_out.obj", corners + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  folder.write("open.obj", corners + "f 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto text = [](const std::string& file, const std::string& scale) {
    return world(model("m", "",
                       "<inertial auto='true'><density>600</density></inertial>" +
                           collision("<mesh><uri>" + file + "</uri><scale>" + scale + "</scale></mesh>")),
                 "1.11");
  };
  for (const std::string file : {"solid.obj", "inside_out.obj"}) {
    for (const double side : {2.0, -2.0}) {
      const LoadedWorld loaded = load(text(file, absl::StrCat(side, " 2 2")), folder);
      const BodyProperties& p = body_named(loaded, "m::l").properties;
      EXPECT_NEAR(p.mass, 800, 1e-9);
      expect_near(Eigen::Vector3d(p.centre.data()), {side / 4, 0.5, 0.5}, 1e-12);
      // 3/80 M L^2 in each direction about its own centre of mass, so twice that about an axis, and products
      // of 1/80 M L^2.
      EXPECT_NEAR(p.inertia[0] + p.inertia[1] + p.inertia[2], 6.0 / 80 * 3 * 800 * 4, 1e-6);
    }
  }
  const absl::StatusOr<LoadedWorld> open = load_world_string(text("open.obj", "1 1 1"), folder);
  EXPECT_THAT(open.status().message(), HasSubstr("collision 'c' has no volume: its surface is not closed"));
}

TEST(Bodies, SurfaceGravityAndDamping) {
  const LoadedWorld loaded = load(world(
      model("a", "",
            "<gravity>false</gravity><velocity_decay><linear>0.1</linear><angular>0.2</angular></"
            "velocity_decay>"
            "<collision "
            "name='c'><geometry><box/></geometry><surface><friction><ode><mu>0.3</mu></ode></friction>"
            "<bounce><restitution_coefficient>0.6</restitution_coefficient></bounce>"
            "<contact><collide_bitmask>6</collide_bitmask></contact></surface></collision>") +
      model(
          "b", "",
          "<collision name='c'><geometry><box/></geometry><surface><friction><bullet><friction>0.7</friction>"
          "</bullet></friction></surface></collision>") +
      model("c", "")));
  const BodyProperties& a = body_named(loaded, "a::l").properties;
  EXPECT_FALSE(a.gravity);
  EXPECT_EQ(a.linear_damping, 0.1);
  EXPECT_EQ(a.angular_damping, 0.2);
  EXPECT_EQ(a.friction, 0.3);
  EXPECT_EQ(a.restitution, 0.6);
  EXPECT_EQ(a.category, 6u);
  EXPECT_EQ(a.mask, 6u);
  EXPECT_EQ(body_named(loaded, "b::l").properties.friction, 0.7);
  const BodyProperties& c = body_named(loaded, "c::l").properties;
  EXPECT_EQ(c.friction, 1);
  EXPECT_EQ(c.category, 0xffffu);
  EXPECT_TRUE(c.gravity);
}

TEST(ModelFile, HasOneModelThatMayHaveAnotherName) {
  const Folder folder;
  folder.write("m.sdf", model_file(model("robot", "<frame name='tool' attached_to='l'/>")));
  absl::StatusOr<WorldDescription> robot =
      load_model_file(static_cast<const std::filesystem::path&>(folder) / "m.sdf");
  ASSERT_TRUE(robot.ok()) << robot.status();
  EXPECT_EQ(model_name(*robot), "robot");
  ASSERT_TRUE(rename_model("r2", *robot).ok());
  EXPECT_EQ(robot->bodies.at(0).name, "r2::l");
  EXPECT_EQ(robot->frames.at(0).name, "r2::tool");
  for (const char* name : {"", "a::b", "\xff"}) EXPECT_FALSE(rename_model(name, *robot).ok()) << name;
  EXPECT_EQ(robot->bodies.at(0).name, "r2::l");
  EXPECT_EQ(load_model_string(world(model("a", "") + model("b", ""))).status().message(),
            "the file has 2 models; only one can be spawned");
}

}  // namespace
}  // namespace tessera
