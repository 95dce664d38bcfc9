// What a body touches that is on fixed surfaces in one plane: that plane, at the points of one patch.
#include "lpss/native/flush_contacts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lpss/native/meetings.h"
#include "lpss/native/narrow_phase.h"

namespace tessera::native {
namespace {

constexpr std::uint64_t kMover = 5;
constexpr double kHalf = 0.15;  // m, of movers
constexpr Scalar kFlushLean = Scalar(1e-3);

// Tiles of 1 m along x and 2 m along y around their origins, with their tops at z = 0.
struct Tile {
  std::string name;
  Geometry geometry;
  double z = 0;  // of the origin
};

TriangleMesh flush_sheet() {
  return {{{-0.5, -1, 0}, {0.5, -1, 0}, {0.5, 1, 0}, {-0.5, 1, 0}}, {0, 1, 2, 0, 2, 3}};
}

// A box of triangles.
TriangleMesh flush_crate() {
  TriangleMesh mesh;
  for (int n = 0; n < 8; ++n)
    mesh.vertices.emplace_back(n & 4 ? 0.5 : -0.5, n & 2 ? 1 : -1, n & 1 ? 0.1 : -0.1);
  mesh.indices = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                  2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
  return mesh;
}

ConvexHull flush_frustum() {
  ConvexHull hull;
  for (const double x : {-1., 1.}) {
    for (const double y : {-1., 1.}) {
      hull.points.emplace_back(0.5 * x, y, 0.1);
      hull.points.emplace_back(0.4 * x, 0.9 * y, -0.1);
    }
  }
  return hull;
}

std::vector<Tile> tiles() {
  return {{"box", tessera::Box{{1, 2, 0.2}}, -0.1},
          {"thick box", tessera::Box{{1, 2, 0.8}}, -0.4},
          {"hull", flush_frustum(), -0.1},
          {"sheet", flush_sheet()},
          {"crate", flush_crate(), -0.1},
          {"height field", HeightField{5, 9, {0.25, 0.25}, std::vector<double>(45, 0)}}};
}

Body flush_body(std::uint64_t id, const Geometry& geometry, const Eigen::Vector3d& position, Motion motion,
                const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity()) {
  BodyRecord record;
  record.id = {id};
  record.properties.motion = motion;
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = position;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(record.state.rotation.data()) = rotation;
  const bool is_static = motion == Motion::kStatic;
  auto solid = std::make_shared<const Solid>(Shape{{ShapePart{geometry, {}}}}, Pose{}, is_static);
  return Body(record, is_static ? Role::kStatic : Role::kHome, std::move(solid), EngineSettings{});
}

template <typename... Bodies>
std::vector<Body> flush_floor(Bodies... bodies) {
  std::vector<Body> all;
  (all.push_back(std::move(bodies)), ...);
  return all;
}

struct Mover {
  std::string name;
  Geometry geometry;
  bool lies = false;  // along y
};

std::vector<Mover> movers() {
  ConvexHull octahedron;  // with a face below
  for (const double side : {-1., 1.}) {
    for (int corner = 0; corner < 3; ++corner) {
      const double angle = 2 * M_PI / 3 * corner + (side > 0 ? M_PI / 3 : 0);
      octahedron.points.emplace_back(0.2 * std::cos(angle), 0.2 * std::sin(angle), kHalf * side);
    }
  }
  return {{"ball", Sphere{kHalf}},
          {"box", tessera::Box{{0.3, 0.3, 0.3}}},
          {"wheel", Cylinder{kHalf, 0.1}, true},
          {"capsule", Capsule{kHalf, 0.1}, true},
          {"can", Cylinder{0.1, 2 * kHalf}},
          {"hull", octahedron}};
}

Body moved(const Mover& mover, double x, double depth, double y = 0.07) {
  const Eigen::Matrix3d lying = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return flush_body(kMover, mover.geometry, {x, y, kHalf - depth}, Motion::kDynamic,
                    mover.lies ? lying : Eigen::Matrix3d::Identity());
}

// What a body touches, with all normals to it.
struct Touching {
  std::vector<Contact> contacts;
  std::vector<Vector> normals;
  int points = 0;
};

Touching touching(const Body& mover, const std::vector<Body>& fixed) {
  Touching result;
  result.contacts.resize(fixed.size());
  std::vector<FixedContact> joined;
  NarrowPhase phase;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    const bool is_a = mover.id < fixed[n].id;
    phase.update(is_a ? mover : fixed[n], is_a ? fixed[n] : mover, result.contacts[n]);
    if (!result.contacts[n].patches.empty()) joined.push_back({&mover, &fixed[n], &result.contacts[n]});
  }
  FlushContacts().join(joined);
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    for (const ContactPatch& patch : result.contacts[n].patches) {
      result.normals.push_back(mover.id < fixed[n].id ? patch.normal : Vector(-patch.normal));
      result.points += patch.count;
    }
  }
  return result;
}

bool is_up(const Vector& normal) { return (normal - Vector::UnitZ()).norm() < kFlushLean; }

// From where a body is all on the first of two tiles to where it is all on the second one.
TEST(FlushContactsTest, OverASeamOfAnyTwoSurfacesThereIsOnlyOnePlane) {
  for (const Tile& left : tiles()) {
    for (const Tile& right : tiles()) {
      for (const bool comes_first : {true, false}) {
        const std::vector<Body> floor =
            flush_floor(flush_body(comes_first ? 1 : 11, left.geometry, {-0.5, 0, left.z}, Motion::kStatic),
                        flush_body(comes_first ? 2 : 12, right.geometry, {0.5, 0, right.z}, Motion::kStatic));
        for (const Mover& mover : movers()) {
          for (int step = -40; step <= 40; ++step) {
            const Touching found = touching(moved(mover, step * 0.00731, 0.0002), floor);
            const std::string what =
                left.name + ", " + right.name + ", " + mover.name + ", " + std::to_string(step);
            EXPECT_FALSE(found.normals.empty()) << what;
            EXPECT_LE(found.points, 4) << what;
            EXPECT_TRUE(std::ranges::all_of(found.normals, is_up))
                << what << ": " << testing::PrintToString(found.normals);
          }
        }
      }
    }
  }
}

TEST(FlushContactsTest, ABoxOverASeamHasItsFourCornersAndOneOverFourTilesToo) {
  std::vector<Body> floor;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-1., 1.})
      floor.push_back(flush_body(floor.size() + 1, tessera::Box{{1, 2, 0.2}}, {x, y, -0.1}, Motion::kStatic));
  }
  const Touching found = touching(moved(movers()[1], 0.03, 0.0002, 0.02), floor);
  EXPECT_EQ(found.normals.size(), 4u);
  EXPECT_EQ(found.points, 4);
  for (std::size_t n = 0; n < floor.size(); ++n) {
    ASSERT_EQ(found.contacts[n].patches.size(), 1u);
    const Vector& corner = found.contacts[n].patches[0].point[0].on_b;
    EXPECT_NEAR(std::abs(corner.x()), kHalf, 1e-5);
    EXPECT_NEAR(std::abs(corner.y()), kHalf, 1e-5);
  }
}

TEST(FlushContactsTest, PartsOfOneBodyAreFlushAsBodiesAre) {
  const Shape deck{{ShapePart{tessera::Box{{1, 2, 0.2}}, {{-0.5, 0, -0.1}, Eigen::Quaterniond::Identity()}},
                    ShapePart{tessera::Box{{1, 2, 0.4}}, {{0.5, 0, -0.2}, Eigen::Quaterniond::Identity()}}}};
  BodyRecord record;
  record.id = {1};
  record.properties.motion = Motion::kStatic;
  record.state.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::vector<Body> floor;
  floor.emplace_back(record, Role::kStatic, std::make_shared<const Solid>(deck, Pose{}, true),
                     EngineSettings{});
  for (const Mover& mover : movers()) {
    for (int step = -30; step <= 30; ++step) {
      const Touching found = touching(moved(mover, step * 0.0093, 0.0002), floor);
      EXPECT_LE(found.points, 4) << mover.name;
      EXPECT_TRUE(std::ranges::all_of(found.normals, is_up)) << mover.name << ", " << step;
    }
  }
}

// The top of a box that is sunk into the ground.
TEST(FlushContactsTest, ABoxInAPlaneIsFlushWithIt) {
  const std::vector<Body> floor =
      flush_floor(flush_body(1, Plane{}, {0, 0, 0}, Motion::kStatic),
                  flush_body(2, tessera::Box{{1, 2, 0.2}}, {0.5, 0, -0.1}, Motion::kStatic));
  for (const Mover& mover : movers()) {
    for (int step = -30; step <= 30; ++step) {
      const Touching found = touching(moved(mover, step * 0.0093, 0.0002), floor);
      EXPECT_LE(found.points, 4) << mover.name;
      EXPECT_TRUE(std::ranges::all_of(found.normals, is_up)) << mover.name << ", " << step;
    }
  }
}

// All on the first tile, and 5 mm before the second one.
bool is_stopped(double step, const Mover& mover, double size = 1) {
  const auto scaled = [&](Geometry geometry) {
    if (auto* box = std::get_if<tessera::Box>(&geometry)) box->size *= size;
    return geometry;
  };
  const Geometry tile = scaled(tessera::Box{{1, 2, 0.2}});
  const std::vector<Body> floor =
      flush_floor(flush_body(1, tile, {-0.5 * size, 0, -0.1 * size}, Motion::kStatic),
                  flush_body(2, tile, {0.5 * size, 0, -0.1 * size + step}, Motion::kStatic));
  Body box = flush_body(kMover, scaled(mover.geometry), {-0.155 * size, 0, kHalf * size}, Motion::kDynamic);
  return !std::ranges::all_of(touching(box, floor).normals, is_up);
}

TEST(FlushContactsTest, AStepOfMoreThanATenthOfAMillimetreIsOne) {
  const Mover box{"box", tessera::Box{{0.3, 0.3, 0.3}}};
  EXPECT_FALSE(is_stopped(0, box));
  EXPECT_FALSE(is_stopped(0.00005, box));
  EXPECT_TRUE(is_stopped(0.00015, box));
  EXPECT_TRUE(is_stopped(0.05, box));
  // Of small bodies, less is one.
  EXPECT_FALSE(is_stopped(0, box, 0.05));
  EXPECT_TRUE(is_stopped(0.00005, box, 0.05));
}

TEST(FlushContactsTest, AWallOnTilesStops) {
  const Geometry tile = tessera::Box{{1, 2, 0.2}};
  const std::vector<Body> floor =
      flush_floor(flush_body(1, tile, {-0.5, 0, -0.1}, Motion::kStatic),
                  flush_body(2, tile, {0.5, 0, -0.1}, Motion::kStatic),
                  flush_body(3, tessera::Box{{0.1, 2, 1}}, {0.05, 0, 0.5}, Motion::kStatic));
  for (const Mover& mover : movers()) {
    const double reach = mover.name == "can" ? 0.1 : mover.name == "hull" ? 0.2 : kHalf;
    const Touching found = touching(moved(mover, -reach - 0.003, 0.0002), floor);
    EXPECT_TRUE(std::ranges::any_of(found.normals, [](const Vector& n) { return n.x() < Scalar(-0.9); }))
        << mover.name;
  }
}

// The lower front edge of a box that leans back is all that is near the wall, at the height of the floor.
TEST(FlushContactsTest, AnEdgeThatSlidesOnTheFloorIsStoppedByAWall) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d edge = turn * Eigen::Vector3d(0.15, 0, -0.15);
  for (const Tile& tile : tiles()) {
    const std::vector<Body> floor =
        flush_floor(flush_body(1, tile.geometry, {-0.5, 0, tile.z}, Motion::kStatic),
                    flush_body(2, tile.geometry, {0.5, 0, tile.z}, Motion::kStatic),
                    flush_body(3, tessera::Box{{0.1, 2, 1}}, {0.05, 0, 0.5}, Motion::kStatic));
    const Body box = flush_body(kMover, tessera::Box{{0.3, 0.3, 0.3}},
                                Eigen::Vector3d(-0.002, 0, -0.0002) - edge, Motion::kDynamic, turn);
    const Touching found = touching(box, floor);
    EXPECT_TRUE(std::ranges::any_of(found.normals, [](const Vector& n) { return n.x() < Scalar(-0.9); }))
        << tile.name;
  }
}

// The floor ends where a ramp begins: neither is flush with the other.
TEST(FlushContactsTest, ARampIsNotFlushWithTheFloorBeforeIt) {
  const double slope = 0.2;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(-slope, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const std::vector<Body> floor = flush_floor(
      flush_body(1, tessera::Box{{1, 2, 0.2}}, {-0.5, 0, -0.1}, Motion::kStatic),
      flush_body(2, tessera::Box{{1, 2, 0.2}}, turn * Eigen::Vector3d(0.5, 0, -0.1), Motion::kStatic, turn));
  const double touches = -kHalf * std::tan(slope / 2);  // where a ball touches both
  const Touching found = touching(moved({"ball", Sphere{kHalf}}, touches, 0.0001), floor);
  ASSERT_EQ(found.normals.size(), 2u);
  EXPECT_NEAR(found.normals[0].z(), 1, 1e-4);
  EXPECT_NEAR(found.normals[1].x(), -std::sin(slope), 1e-3);
}

// Whether a body that touches the first of two boxes meets the second one, which is so much higher, within a
// tick.
bool meets(const Body& mover, double step) {
  constexpr Scalar kTick = Scalar(1) / 60;
  const Geometry tile = tessera::Box{{1, 2, 0.2}};
  const std::vector<Body> floor = flush_floor(flush_body(1, tile, {-0.5, 0, -0.1}, Motion::kStatic),
                                              flush_body(2, tile, {0.5, 0, -0.1 + step}, Motion::kStatic));
  Contact touching;
  NarrowPhase().update(floor[0], mover, touching);
  Contact seen;
  const std::optional<Scalar> share = MeetingSearch().find(floor[1], mover, kTick, seen);
  EXPECT_TRUE(share && !touching.patches.empty() && !seen.patches.empty());
  if (!share) return false;
  const FixedContact bears{&mover, &floor[0], &touching};
  const FixedMeeting meeting{&mover, &floor[1], &seen, Course(mover, kTick).at(*share)};
  FlushContacts().join(std::span(&bears, 1), std::span(&meeting, 1), kTick);
  return !seen.patches.empty();
}

TEST(FlushContactsTest, WhatIsFlushIsNotMet) {
  for (const Mover& mover : movers()) {
    Body fast = moved(mover, -0.21, 0.0002);
    fast.linear = {12, 0, 0};
    fast.angular = {0, mover.name == "wheel" || mover.name == "ball" ? Scalar(12 / kHalf) : 0, 0};
    EXPECT_FALSE(meets(fast, 0)) << mover.name;
    EXPECT_TRUE(meets(fast, 0.01)) << mover.name;
    fast.linear.z() = -1;
    EXPECT_FALSE(meets(fast, 0)) << mover.name;
  }
}

// On its rear edge, it falls on its front edge behind the seam.
TEST(FlushContactsTest, WhatComesDownBesideWhatBearsItMeetsWhatIsThere) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d edge = turn * Eigen::Vector3d(-0.15, 0, -0.15);
  Body box = flush_body(kMover, tessera::Box{{0.3, 0.3, 0.3}}, Eigen::Vector3d(-0.1, 0, -0.0002) - edge,
                        Motion::kDynamic, turn);
  box.angular = {0, 30, 0};
  box.linear = box.angular.cross(Vector(-edge.cast<Scalar>()));
  EXPECT_TRUE(meets(box, 0));
}

}  // namespace
}  // namespace tessera::native
