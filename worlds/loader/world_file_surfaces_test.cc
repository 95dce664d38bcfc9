// Surfaces and shapes of real models: friction of all kinds, belts, outlines, height maps, cones, and concave
// meshes in parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "lpss/model/limits.h"
#include "worlds/loader/convex_parts.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kStatic = "<static>true</static>";

std::string with_surface(const std::string& surface, const std::string& pose = "") {
  return collision("<box><size>1 1 1</size></box>",
                   (pose.empty() ? "" : "<pose>" + pose + "</pose>") + "<surface>" + surface + "</surface>");
}

BodyProperties properties_of(const LoadedWorld& loaded) { return body_named(loaded, "m::l").properties; }

std::string error_of(const std::string& of_link, const std::filesystem::path& folder = "/") {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(world(model("m", kStatic, of_link)), folder);
  EXPECT_FALSE(loaded.ok());
  return std::string(loaded.status().message());
}

// Surfaces.

TEST(Surfaces, FrictionByDirectionTurnsWithItsCollision) {
  const LoadedWorld loaded = load(world(
      model("m", "",
            with_surface("<friction><ode><mu>0.6</mu><mu2>0.2</mu2><fdir1>1 0 0</fdir1></ode></friction>",
                         "0 0 0 0 0 1.5707963267948966"))));
  EXPECT_THAT(loaded.notices, IsEmpty());
  const BodyProperties properties = properties_of(loaded);
  EXPECT_EQ(properties.friction, 0.6);
  ASSERT_TRUE(properties.surface.has_value());
  EXPECT_EQ(properties.surface->second_friction, 0.2);
  expect_near(Eigen::Vector3d(properties.surface->direction.data()), {0, 1, 0}, 1e-9);
}

TEST(Surfaces, FrictionOfUrdfIsInExtensionsForGazebo) {
  const std::string link =
      "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
      "<collision><geometry><box size='1 1 1'/></geometry></collision></link>";
  const LoadedWorld loaded = load(
      "<robot name='r'><link name='hip'>" + link + "<link name='foot'>" + link +
      "<joint name='j' type='continuous'><parent link='hip'/><child link='foot'/><origin xyz='0 0 "
      "2'/></joint>"
      "<gazebo reference='hip'><mu1>0.4</mu1><mu2>0.4</mu2></gazebo>"
      "<gazebo reference='foot'><mu1 value='0.6'/><mu2 value='0.2'/><fdir1 value='0 1 0'/></gazebo></robot>");
  EXPECT_EQ(body_named(loaded, "r::hip").properties.friction, 0.4);
  const BodyProperties foot = body_named(loaded, "r::foot").properties;
  EXPECT_EQ(foot.friction, 0.6);
  ASSERT_TRUE(foot.surface.has_value());
  EXPECT_EQ(foot.surface->second_friction, 0.2);
  expect_near(Eigen::Vector3d(foot.surface->direction.data()), {0, 1, 0}, 1e-9);
  EXPECT_THAT(loaded.notices, ElementsAre("1 joint (1 revolute) simulated"));
}

TEST(Surfaces, ASecondCoefficientWithoutADirectionIsNamed) {
  const LoadedWorld loaded =
      load(world(model("m", "", with_surface("<friction><ode><mu>0.6</mu><mu2>0.2</mu2></ode></friction>"))));
  EXPECT_THAT(loaded.notices, ElementsAre("1 x <mu2> without <fdir1>: friction is alike in all directions"));
  EXPECT_FALSE(properties_of(loaded).surface.has_value());
}

// The direction of friction, in a link that is turned by a quarter in its model.
TEST(Surfaces, FrictionInTheFrameThatTheFileNames) {
  const auto direction_in = [](const std::string& frame, const std::string& of_model = "") {
    const std::string attribute = frame.empty() ? "" : " gz:expressed_in='" + frame + "'";
    const LoadedWorld loaded = load(world("<model name='m'>" + of_model +
                                          "<link name='l'><pose>0 0 1 0 0 1.5707963267948966</pose>" +
                                          with_surface("<friction><ode><mu>0.6</mu><mu2>0.2</mu2><fdir1" +
                                                           attribute + ">1 0 0</fdir1></ode></friction>",
                                                       "0 0 0 0 0 1.5707963267948966") +
                                          "</link><link name='other'>" + kUnitBox +
                                          "</link><frame name='skew' attached_to='l'><pose>0 0 0 0 0 "
                                          "0.5235987755982988</pose></frame></model>"));
    EXPECT_THAT(loaded.notices, IsEmpty()) << frame;
    return Eigen::Vector3d(properties_of(loaded).surface.value_or(Surface{}).direction.data());
  };
  expect_near(direction_in(""), {0, 1, 0}, 1e-9);
  expect_near(direction_in("l"), {1, 0, 0}, 1e-9);
  expect_near(direction_in("__model__"), {0, -1, 0}, 1e-9);
  expect_near(direction_in("skew"), {std::cos(std::numbers::pi / 6), std::sin(std::numbers::pi / 6), 0},
              1e-9);
  expect_near(direction_in("other", kStatic), {0, -1, 0}, 1e-9);  // in a static model all frames are fixed
}

TEST(Surfaces, FrictionInAFrameThatMovesOtherwiseIsNamedAndRefused) {
  for (const char* frame : {"other", "nowhere"}) {
    const std::string xml = world(
        "<model name='m'><link name='l'>" +
        with_surface(std::string("<friction><ode><mu>0.6</mu><mu2>0.2</mu2><fdir1 ignition:expressed_in='") +
                     frame + "'>1 0 0</fdir1></ode></friction>") +
        "</link><link name='other'>" + kUnitBox + "</link></model>");
    const LoadedWorld loaded = load(xml);
    EXPECT_THAT(loaded.notices, Contains(HasSubstr(std::string("1 x <fdir1> expressed in '") + frame + "'")));
    EXPECT_EQ(properties_of(loaded).surface, std::nullopt);
    EXPECT_THAT(std::string(load_world_string(xml, "/", Faults::kRefuse).status().message()),
                HasSubstr("has faults: 1 x <fdir1> expressed in"));
  }
}

// Each collision of a link has its own; the direction is in the frame of its part.
TEST(Surfaces, OfEachCollision) {
  const auto part = [](const std::string& name, const std::string& surface,
                       const std::string& pose = "0 0 0 0 0 0") {
    return "<collision name='" + name + "'><pose>" + pose +
           "</pose><geometry><box><size>1 1 1</size></box></geometry>" + "<surface>" + surface +
           "</surface></collision>";
  };
  const LoadedWorld loaded = load(world(model(
      "m", "",
      part("a",
           "<friction><ode><mu>0.3</mu></ode></friction><contact><collide_bitmask>1</collide_bitmask></"
           "contact>") +
          part("b",
               "<friction><ode><mu>0.6</mu><mu2>0.2</mu2><fdir1>1 0 0</fdir1></ode></friction><bounce>"
               "<restitution_coefficient>0.5</restitution_coefficient></bounce><contact><collide_bitmask>6"
               "</collide_bitmask><category_bitmask>8</category_bitmask></contact>",
               "0 0 2 0 0 1.5707963267948966"))));
  EXPECT_THAT(loaded.notices, IsEmpty());
  const BodyProperties properties = properties_of(loaded);
  EXPECT_EQ(properties.friction, 0.3);
  EXPECT_EQ(properties.surface, std::nullopt);
  EXPECT_EQ(properties.mask, 7u);
  EXPECT_EQ(properties.category, 9u);
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::l"));
  ASSERT_EQ(shape.parts.size(), 2u);
  EXPECT_EQ(shape.parts[0].material, (PartMaterial{0.3, 0, 1, 1, {}}));
  ASSERT_TRUE(shape.parts[1].material.has_value());
  const PartMaterial& second = *shape.parts[1].material;
  EXPECT_EQ(second.friction, 0.6);
  EXPECT_EQ(second.restitution, 0.5);
  EXPECT_EQ(second.category, 8u);
  EXPECT_EQ(second.mask, 6u);
  EXPECT_EQ(second.surface.second_friction, 0.2);
  expect_near(Eigen::Vector3d(second.surface.direction.data()), {1, 0, 0}, 1e-9);
}

TEST(Surfaces, CollisionsThatAreAlikeShareThatOfTheBody) {
  const std::string surface = "<surface><friction><ode><mu>0.3</mu></ode></friction></surface>";
  const LoadedWorld loaded = load(world(model(
      "m", "",
      collision("<box><size>1 1 1</size></box>", surface) + "<collision name='d'><pose>0 0 3 0 0 0</pose>" +
          surface + "<geometry><box><size>1 1 1</size></box></geometry></collision>")));
  for (const ShapePart& part : shape_of(loaded, body_named(loaded, "m::l")).parts)
    EXPECT_EQ(part.material, std::nullopt);
}

TEST(Surfaces, OfEachCollisionAreNotThoseOfThePaper) {
  const std::string link =
      collision("<box><size>1 1 1</size></box>") +
      "<collision "
      "name='d'><surface><friction><ode><mu>0.3</mu></ode></friction></surface><geometry><box><size>1 1 1"
      "</size></box></geometry></collision>";
  const LoadedWorld loaded =
      load(world("<tessera:settings><seams>clone</seams></tessera:settings>" + model("m", "", link)));
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("with the seams `clone`, the first one's counts for all")));
}

TEST(Surfaces, TorsionalAndRollingFriction) {
  const LoadedWorld loaded = load(world(
      model("m", "",
            with_surface(
                "<friction><bullet><friction>0.7</friction><friction2>0.7</friction2>"
                "<rolling_friction>0.02</rolling_friction></bullet><torsional><coefficient>0.8</coefficient>"
                "<use_patch_radius>true</use_patch_radius><patch_radius>0.05</patch_radius></torsional>"
                "</friction>"))));
  EXPECT_THAT(loaded.notices, IsEmpty());
  const BodyProperties properties = properties_of(loaded);
  EXPECT_EQ(properties.friction, 0.7);
  EXPECT_EQ(properties.surface,
            (Surface{.torsional_friction = 0.8, .patch_radius = 0.05, .rolling_friction = 0.02}));
}

TEST(Surfaces, AMovingSurface) {
  const LoadedWorld loaded = load(world(
      model("m", kStatic,
            kUnitBox + "<tessera:surface_motion velocity='0.1 -2 0' running='0 0.30000000000000004 0'/>")));
  EXPECT_EQ(properties_of(loaded).surface,
            (Surface{.velocity = {0.1, -2, 0}, .running = {0, 0.30000000000000004, 0}}));
  EXPECT_THAT(error_of(kUnitBox + "<tessera:surface_motion speed='1'/>"),
              HasSubstr("unknown attribute 'speed'"));
  EXPECT_THAT(error_of(kUnitBox + "<tessera:surface_motion velocity='2000 0 0'/>"),
              HasSubstr("surface velocity = 2000 m/s must be at most 1000 m/s"));
  EXPECT_THAT(error_of(with_surface("<friction><bullet><rolling_friction>-1</rolling_friction></bullet>"
                                    "</friction>")),
              HasSubstr("rolling friction = -1"));
}

TEST(Triggers, ACollisionMayBeOne) {
  const std::string notices =
      "<collision "
      "name='near'><geometry><sphere><radius>2</radius></sphere></geometry><tessera:trigger/></collision>";
  const LoadedWorld whole = load(world(model("m", kStatic, notices)));
  EXPECT_THAT(whole.notices, IsEmpty());
  EXPECT_TRUE(properties_of(whole).trigger);
  const LoadedWorld part = load(world(model("m", "", "<inertial auto='true'/>" + kUnitBox + notices)));
  const LoadedWorld without = load(world(model("m", "", "<inertial auto='true'/>" + kUnitBox)));
  EXPECT_FALSE(properties_of(part).trigger);
  EXPECT_TRUE(has_triggers(part.world.shapes.at(0)));
  EXPECT_FALSE(has_triggers(without.world.shapes.at(0)));
  EXPECT_EQ(properties_of(part).mass, properties_of(without).mass);
  EXPECT_EQ(properties_of(part).inertia, properties_of(without).inertia);
  EXPECT_THAT(error_of(kUnitBox + "<tessera:trigger/>"), HasSubstr("it belongs in a <collision>"));
  EXPECT_THAT(error_of("<collision name='near'><geometry><sphere><radius>2</radius></sphere></geometry>"
                       "<tessera:trigger>maybe</tessera:trigger></collision>"),
              HasSubstr("'maybe' must be true or false"));
}

// Outlines.

std::string polyline(const std::string& points, const std::string& height = "<height>2</height>") {
  std::string text = "<polyline>";
  for (std::size_t at = 0; at < points.size();) {
    const std::size_t end = std::min(points.find(',', at), points.size());
    text += "<point>" + points.substr(at, end - at) + "</point>";
    at = end + 1;
  }
  return text + height + "</polyline>";
}

double area_of_hull_base(const ConvexHull& hull) {
  Outline base;
  for (const Eigen::Vector3d& point : hull.points) {
    if (point.z() == 0) base.push_back(point.head<2>());
  }
  return double_area(base) / 2;
}

const std::string kEll = "0 0,3 0,3 1,1 1,1 3,0 3";  // of area 5

TEST(Outlines, AConvexOneIsAHull) {
  const LoadedWorld loaded = load(world(model("m", "", collision(polyline("0 0,0 1,2 1,2 0,0 0")))));
  const auto hull = only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(hull.points.size(), 8u);
  EXPECT_EQ(area_of_hull_base(hull), 2) << "counter-clockwise, though the file has it clockwise";
  EXPECT_THAT(loaded.notices, IsEmpty());
}

TEST(Outlines, AConcaveOneThatMovesIsConvexParts) {
  const LoadedWorld loaded = load(world(model("m", "", collision(polyline(kEll)))));
  double area = 0;
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(shape.parts.size(), 2u);
  for (const ShapePart& part : shape.parts) area += area_of_hull_base(std::get<ConvexHull>(part.geometry));
  EXPECT_NEAR(area, 5, 1e-12);
}

TEST(Outlines, AConcaveOneThatIsStaticIsAClosedSurface) {
  const LoadedWorld loaded = load(world(model("m", kStatic, collision(polyline(kEll)))));
  const auto mesh = only_geometry<TriangleMesh>(loaded, body_named(loaded, "m::l"));
  double volume = 0;  // by the divergence theorem
  for (std::size_t n = 0; n < mesh.indices.size(); n += 3) {
    const Eigen::Vector3d& a = mesh.vertices[mesh.indices[n]];
    volume += a.dot(mesh.vertices[mesh.indices[n + 1]].cross(mesh.vertices[mesh.indices[n + 2]])) / 6;
  }
  EXPECT_NEAR(volume, 10, 1e-12);
}

TEST(Outlines, PartsOfRandomStarsCoverThem) {
  for (int seed = 1; seed <= 30; ++seed) {
    Outline star;
    const int corners = 3 + seed;
    for (int n = 0; n < corners; ++n) {
      const double angle = 2 * std::numbers::pi * n / corners;
      const double radius = 1 + 0.8 * std::sin(seed * 7.0 * n + seed);
      star.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    const absl::StatusOr<std::vector<Outline>> parts = convex_parts(star);
    ASSERT_TRUE(parts.ok()) << seed;
    double area = 0;
    for (const Outline& part : *parts) {
      area += double_area(part);
      for (std::size_t n = 0; n < part.size(); ++n) {
        const Outline corner = {part[n], part[(n + 1) % part.size()], part[(n + 2) % part.size()]};
        EXPECT_GE(double_area(corner), -1e-12) << seed;
      }
    }
    EXPECT_NEAR(area, double_area(star), 1e-6) << seed;
  }
}

TEST(Outlines, BadOnesAreRefused) {
  EXPECT_THAT(error_of(collision(polyline("0 0,1 0"))), HasSubstr("3 different points"));
  EXPECT_THAT(error_of(collision(polyline("0 0,1 0,2 0"))), HasSubstr("the area must be at least"));
  EXPECT_THAT(error_of(collision(polyline("0 0,2 2,2 0,0 1"))), HasSubstr("crosses or touches itself"));
  EXPECT_THAT(error_of(collision(polyline(kEll, ""))), HasSubstr("the <height> is missing"));
  EXPECT_THAT(error_of(collision(polyline("0 0,1 0,1 x"))), HasSubstr("x"));
}

TEST(Outlines, AHoleIsNamed) {
  const LoadedWorld loaded = load(world(model(
      "m", kStatic,
      collision(polyline("0 0,9 0,9 9,0 9") + polyline("1 1,2 1,2 2,1 2") + polyline("20 0,21 0,20 1")))));
  EXPECT_THAT(loaded.notices, ElementsAre("1 x <polyline> inside another, a hole, filled"));
  EXPECT_EQ(shape_of(loaded, body_named(loaded, "m::l")).parts.size(), 2u);
}

TEST(Cones, AreHullsWithTheirTipUp) {
  const LoadedWorld loaded =
      load(world(model("m", "", collision("<cone><radius>0.5</radius><length>2</length></cone>"))));
  const auto hull = only_geometry<ConvexHull>(loaded, body_named(loaded, "m::l"));
  EXPECT_EQ(hull.points.front(), Eigen::Vector3d(0, 0, 1));
  for (std::size_t n = 1; n < hull.points.size(); ++n) {
    EXPECT_EQ(hull.points[n].z(), -1);
    EXPECT_NEAR(hull.points[n].head<2>().norm(), 0.5, 1e-12);
  }
  EXPECT_THAT(loaded.notices, IsEmpty());
}

// A cylinder of 32 sides is 0.6 % lighter than a round one, and so is a cone.
TEST(Shapes, AutomaticInertiaOfConesAndOutlines) {
  const std::string automatic = "<inertial auto='true'><density>500</density></inertial>";
  const LoadedWorld cone = load(world(
      model("m", "", automatic + collision("<cone><radius>0.5</radius><length>2</length></cone>")), "1.11"));
  const BodyProperties& p = properties_of(cone);
  const double mass = 500 * std::numbers::pi * 0.25 * 2 / 3;
  EXPECT_NEAR(p.mass, mass, 0.01 * mass);
  expect_near(Eigen::Vector3d(p.centre.data()), {0, 0, -0.5}, 1e-9);
  EXPECT_NEAR(p.inertia[0], mass * (3 * 0.25 / 20 + 3 * 4 / 80.0), 0.02 * mass * 0.1875);
  EXPECT_NEAR(p.inertia[2], mass * 3 * 0.25 / 10, 0.02 * mass * 0.075);

  const LoadedWorld ell = load(world(model("m", "", automatic + collision(polyline(kEll))), "1.11"));
  EXPECT_NEAR(properties_of(ell).mass, 500 * 10, 1e-6);
  // Of two boxes: 3 x 1 around (1.5, 0.5) and 1 x 2 around (0.5, 2).
  expect_near(Eigen::Vector3d(properties_of(ell).centre.data()), {1.1, 1.1, 1}, 1e-9);
}

// Height maps.

void write_png(const std::filesystem::path& file, std::uint32_t columns, std::uint32_t rows,
               png_uint_32 format, const void* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = columns;
  image.height = rows;
  image.format = format;
  ASSERT_NE(png_image_write_to_file(&image, file.c_str(), 0, pixels, 0, nullptr), 0) << image.message;
}

std::string height_map(const std::string& file, const std::string& more) {
  return collision("<heightmap><uri>" + file + "</uri>" + more + "</heightmap>");
}

TEST(HeightMaps, AreTerrainsSeenFromAbove) {
  const Folder folder;
  folder.write("unused", "");
  const std::vector<std::uint8_t> pixels = {0, 51, 102, 153, 204, 255};
  write_png(std::filesystem::path(folder) / "hills.png", 3, 2, PNG_FORMAT_GRAY, pixels.data());
  const LoadedWorld loaded = load(
      world(model("m", kStatic, height_map("hills.png", "<size>4 10 5</size><pos>1 2 3</pos>"))), folder);
  const Shape& shape = shape_of(loaded, body_named(loaded, "m::l"));
  ASSERT_EQ(shape.parts.size(), 1u);
  const auto& field = std::get<HeightField>(shape.parts[0].geometry);
  EXPECT_EQ(field.columns, 3u);
  EXPECT_EQ(field.rows, 2u);
  EXPECT_EQ(field.spacing, Eigen::Vector2d(2, 10));
  EXPECT_THAT(field.heights, ElementsAre(3, 4, 5, 0, 1, 2)) << "the upper row is at the larger y";
  expect_near(shape.parts[0].pose.position, {1, 2, 3});
}

TEST(HeightMaps, OfSixteenBitsKeepThem) {
  const Folder folder;
  folder.write("unused", "");
  const std::vector<std::uint16_t> pixels = {0, 65535, 1, 32768};
  write_png(std::filesystem::path(folder) / "deep.png", 2, 2, PNG_FORMAT_LINEAR_Y, pixels.data());
  const LoadedWorld loaded =
      load(world(model("m", kStatic, height_map("deep.png", "<size>1 1 65535</size>"))), folder);
  const auto field = only_geometry<HeightField>(loaded, body_named(loaded, "m::l"));
  EXPECT_THAT(field.heights, ElementsAre(1, 32768, 0, 65535));
}

TEST(HeightMaps, BadOnesAreRefused) {
  const Folder folder;
  folder.write("text.png", "this is no image");
  EXPECT_THAT(error_of(height_map("text.png", ""), folder), HasSubstr("it must be a PNG image"));
  EXPECT_THAT(error_of(height_map("none.png", ""), folder), HasSubstr("none.png"));
  const std::vector<std::uint8_t> pixels(4);
  write_png(std::filesystem::path(folder) / "flat.png", 2, 2, PNG_FORMAT_GRAY, pixels.data());
  EXPECT_THAT(error_of(height_map("flat.png", "<size>0 1 1</size>"), folder), HasSubstr("the size must be"));
  EXPECT_THAT(error_of(height_map("flat.png", "<size>1 1</size>"), folder), HasSubstr("3 numbers"));
}

// Concave meshes.

// An L, one metre thick.
SubMesh ell() {
  SubMesh mesh;
  const auto quad = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                        const Eigen::Vector3d& d) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
    for (const std::uint32_t n : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + n);
  };

  const std::vector<Eigen::Vector2d> outline = {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}};
  const auto at = [](const Eigen::Vector2d& p, double z) { return Eigen::Vector3d(p.x(), p.y(), z); };
  for (std::size_t n = 0; n < outline.size(); ++n) {
    const Eigen::Vector2d& p = outline[n];
    const Eigen::Vector2d& q = outline[(n + 1) % outline.size()];
    quad(at(p, 0), at(q, 0), at(q, 1), at(p, 1));
  }
  for (const double z : {0.0, 1.0}) {
    quad(at(outline[0], z), at({1, 0}, z), at(outline[3], z), at({0, 1}, z));
    quad(at({1, 0}, z), at(outline[1], z), at(outline[2], z), at(outline[3], z));
    quad(at({0, 1}, z), at(outline[3], z), at(outline[4], z), at(outline[5], z));
  }
  return mesh;
}

std::string as_obj(const SubMesh& mesh) {
  std::string text = "o ell\n";
  for (const Eigen::Vector3d& v : mesh.vertices)
    text += absl::StrCat("v ", v.x(), " ", v.y(), " ", v.z(), "\n");
  for (std::size_t n = 0; n < mesh.indices.size(); n += 3)
    text += absl::StrCat("f ", mesh.indices[n] + 1, " ", mesh.indices[n + 1] + 1, " ",
                         mesh.indices[n + 2] + 1, "\n");
  return text;
}

bool is_within(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& low,
               const Eigen::Vector3d& high) {
  return std::ranges::all_of(points, [&](const Eigen::Vector3d& p) {
    return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  });
}

TEST(ConcaveMeshes, AreDividedIntoPartsThatFollowThem) {
  EXPECT_FALSE(is_convex(ell()));
  const auto parts = divided(ell(), 16);
  ASSERT_TRUE(parts.has_value());
  EXPECT_GE(parts->size(), 2u);
  EXPECT_LE(parts->size(), 4u);
  for (const std::vector<Eigen::Vector3d>& part : *parts) {
    EXPECT_TRUE(is_within(part, {0, 0, 0}, {3, 1, 1}) || is_within(part, {0, 0, 0}, {1, 3, 1}));
  }
  EXPECT_EQ(divided(ell(), 16), parts) << "the same each time";
}

// HACD would look at all pairs of triangles that share an edge: two million.
TEST(ConcaveMeshes, WithManyTrianglesAtAnEdgeAreNotDivided) {
  constexpr std::uint32_t kPages = 2000;
  SubMesh book;
  book.vertices = {{0, 0, 0}, {0, 0, 1}};
  for (std::uint32_t n = 0; n < kPages; ++n) {
    const double turn = 2 * std::numbers::pi * n / kPages;
    book.vertices.emplace_back(std::cos(turn), std::sin(turn), 0.5);
    for (const std::uint32_t corner : {0u, 1u, n + 2}) book.indices.push_back(corner);
  }
  EXPECT_EQ(divided(book, 16), std::nullopt);
}

TEST(ConcaveMeshes, MayBeDividedWhereTheFileSaysSo) {
  const Folder folder;
  folder.write("ell.obj", as_obj(ell()));
  const auto shape_with = [&](const std::string& attributes, const std::string& more,
                              const std::string& of_model) {
    return load(world(model("m", of_model,
                            collision("<mesh" + attributes + "><uri>ell.obj</uri>" + more + "</mesh>"))),
                folder);
  };
  const LoadedWorld whole = shape_with("", "", "");
  EXPECT_THAT(whole.notices, ElementsAre("1 x concave mesh object that moves, taken as its convex hull"));
  EXPECT_EQ(shape_of(whole, body_named(whole, "m::l")).parts.size(), 1u);
  const LoadedWorld parts = shape_with(" optimization='convex_decomposition'",
                                       "<convex_decomposition><max_convex_hulls>8</max_convex_hulls>"
                                       "</convex_decomposition>",
                                       "");
  EXPECT_THAT(parts.notices, IsEmpty());
  EXPECT_GE(shape_of(parts, body_named(parts, "m::l")).parts.size(), 2u);
  const LoadedWorld fixed = shape_with(" optimization='convex_decomposition'", "", kStatic);
  only_geometry<TriangleMesh>(fixed, body_named(fixed, "m::l"));
  const absl::StatusOr<LoadedWorld> many = load_world_string(
      world(
          model("m", "",
                collision("<mesh optimization='convex_decomposition'><uri>ell.obj</uri><convex_decomposition>"
                          "<max_convex_hulls>1000</max_convex_hulls></convex_decomposition></mesh>"))),
      folder);
  EXPECT_THAT(many.status().message(), HasSubstr("1000 must be 1 to 64"));
}

}  // namespace
}  // namespace tessera
