// The points of two bodies: where they are, and that impulses stay with them.
#include "lpss/native/narrow_phase.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <tuple>

namespace tessera::native {
namespace {

// A ridge along y, 1 m high, whose sides fall by 45 degrees; 8 m long.
TriangleMesh ridge() {
  return {{{-1, -4, 0}, {-1, 4, 0}, {0, -4, 1}, {0, 4, 1}, {1, -4, 0}, {1, 4, 0}},
          {0, 2, 1, 2, 3, 1, 2, 4, 3, 4, 5, 3}};
}

Body body(std::uint64_t id, const Geometry& geometry, const Vector& position,
          Motion motion = Motion::kDynamic) {
  BodyRecord record;
  record.id = {id};
  record.properties.motion = motion;
  record.state.position = array(position);
  const bool is_static = motion == Motion::kStatic;
  auto solid = std::make_shared<const Solid>(Shape{{ShapePart{geometry, {}}}}, Pose{}, is_static);
  return Body(record, is_static ? Role::kStatic : Role::kHome, std::move(solid), EngineSettings{});
}

constexpr Scalar kExact = Scalar(1e-5);

TEST(NarrowPhaseTest, ABoxOnAPlaneABoxAndASurfaceHasFourPointsBelowItsCorners) {
  const HeightField flat{9, 9, {1, 1}, std::vector<double>(81, 0)};
  const TriangleMesh quad{{{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0}}, {0, 1, 2, 0, 2, 3}};
  const std::pair<Geometry, Scalar> grounds[] = {
      {Plane{}, 0}, {tessera::Box{{8, 8, 2}}, -1}, {flat, 0}, {quad, 0}};
  for (const auto& [ground, height] : grounds) {
    NarrowPhase phase;
    const Body floor = body(1, ground, {0, 0, height}, Motion::kStatic);
    const Body box = body(2, tessera::Box{}, {Scalar(0.1), Scalar(0.2), Scalar(0.499)});
    Contact contact;
    phase.update(floor, box, contact);
    ASSERT_EQ(contact.patches.size(), 1u) << ground.index();
    const ContactPatch& patch = contact.patches[0];
    EXPECT_NEAR(patch.normal.z(), -1, kExact) << "from the box to the floor";
    ASSERT_EQ(patch.count, 4) << ground.index();
    int corners = 0;
    for (int n = 0; n < 4; ++n) {
      EXPECT_NEAR(patch.point[n].gap, -0.001, kExact);
      const Vector place = patch.point[n].on_b.cwiseAbs();
      EXPECT_LE(place.head<2>().maxCoeff(), 0.5 + kExact);
      corners += place.head<2>().minCoeff() > 0.5 - kExact;
    }
    // A surface also has points where its edges cross those of the box.
    const bool is_surface =
        ground.index() == Geometry(flat).index() || ground.index() == Geometry(quad).index();
    EXPECT_GE(corners, is_surface ? 3 : 4) << ground.index();
  }
}

// The centre of the ball is known to half a metre only, the surface to a micrometre.
TEST(NarrowPhaseTest, APlanetIsRoundAndWhereItShouldBe) {
  const double radius = 6'371'000.3;
  const Eigen::Vector3d up = Eigen::Vector3d(1, 2, 2) / 3;
  BodyRecord record;
  record.properties.motion = Motion::kStatic;
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = up * -radius;
  const auto solid = std::make_shared<const Solid>(Shape{{ShapePart{Sphere{radius}, {}}}}, Pose{}, true);
  for (const std::uint64_t id : {1, 9}) {
    record.id = {id};
    const Body planet(record, Role::kStatic, solid, EngineSettings{});
    Body box = body(5, tessera::Box{{1, 1, 1}}, (up * 0.499).cast<Scalar>());
    box.pose.rotation =
        Eigen::Quaternion<Scalar>::FromTwoVectors(Vector::UnitZ(), up.cast<Scalar>()).toRotationMatrix();
    NarrowPhase phase;
    Contact contact;
    id < 5 ? phase.update(planet, box, contact) : phase.update(box, planet, contact);
    ASSERT_EQ(contact.patches.size(), 1u);
    const ContactPatch& patch = contact.patches[0];
    ASSERT_EQ(patch.count, 4);
    EXPECT_NEAR(patch.normal.cast<double>().dot(up), id < 5 ? -1 : 1, 1e-6);
    for (int n = 0; n < 4; ++n) {
      EXPECT_NEAR(patch.point[n].gap, -0.001, 2e-6);
      EXPECT_NEAR((id < 5 ? patch.point[n].on_b : patch.point[n].on_a).cwiseAbs().minCoeff(), 0.5, 1e-5);
    }
  }
}

// However coarse numbers are beside it.
TEST(NarrowPhaseTest, ACoinOnALargeFloorHasPointsWhereverItLies) {
  const Body floor = body(1, tessera::Box{{20, 20, 2}}, {0, 0, -1}, Motion::kStatic);
  for (int n = 0; n < 500; ++n) {
    const Scalar height = Scalar(0.001 - 2e-5 * (n % 7) / 7);
    Body coin = body(2, Cylinder{0.005, 0.002}, {Scalar(0.0123 * n), Scalar(-0.0071 * n), height});
    coin.pose.rotation = Matrix(
        Eigen::AngleAxis<Scalar>(Scalar(n), Vector::UnitZ()) *
        Eigen::AngleAxis<Scalar>(Scalar(n % 2 ? M_PI : 0) + Scalar(1e-6) * Scalar(n % 5), Vector::UnitX()));
    NarrowPhase phase;
    Contact contact;
    phase.update(floor, coin, contact);
    ASSERT_EQ(contact.patches.size(), 1u) << n;
    EXPECT_NEAR(contact.patches[0].normal.z(), -1, 1e-3) << n;
  }
}

TEST(NarrowPhaseTest, ACylinderStandsOnItsCapAndLiesOnItsSide) {
  NarrowPhase phase;
  const Body floor = body(1, tessera::Box{{8, 8, 2}}, {0, 0, -1}, Motion::kStatic);
  const Body standing = body(2, Cylinder{0.5, 1}, {0, 0, Scalar(0.5)});
  Contact contact;
  phase.update(floor, standing, contact);
  ASSERT_EQ(contact.patches.size(), 1u);
  EXPECT_EQ(contact.patches[0].count, 4);

  Body lying = body(3, Cylinder{0.5, 1}, {0, 0, Scalar(0.5)});
  lying.pose.rotation = Eigen::AngleAxis<Scalar>(Scalar(M_PI / 2), Vector::UnitX()).toRotationMatrix();
  Contact along;
  phase.update(floor, lying, along);
  ASSERT_EQ(along.patches.size(), 1u);
  EXPECT_EQ(along.patches[0].count, 2);
  EXPECT_NEAR(along.patches[0].normal.z(), -1, Scalar(1e-3));
}

// A normal that leans is a slope: rollers gained speed on level floors.
TEST(NarrowPhaseTest, WhateverRollsOnABoxIsPushedAlongTheNormalOfItsFace) {
  NarrowPhase phase;
  const Body floor = body(1, tessera::Box{{200, 200, 2}}, {0, 0, -1}, Motion::kStatic);
  for (const Geometry& shape : {Geometry(Cylinder{0.2, 0.5}), Geometry(Cylinder{0.2, 0.05}),
                                Geometry(tessera::Ellipsoid{{0.2, 0.2, 0.4}})}) {
    for (int n = 0; n < 100; ++n) {
      Body roller = body(2, shape, {Scalar(0.37 * n), 5, Scalar(0.1999)});
      roller.pose.rotation = (Eigen::AngleAxis<Scalar>(Scalar(0.1 * n), Vector::UnitY()) *
                              Eigen::AngleAxis<Scalar>(Scalar(M_PI / 2), Vector::UnitX()))
                                 .toRotationMatrix();
      Contact contact;
      phase.update(floor, roller, contact);
      ASSERT_EQ(contact.patches.size(), 1u) << shape.index() << ", " << n;
      EXPECT_EQ(contact.patches[0].normal, Vector(0, 0, -1)) << shape.index() << ", " << n;
      EXPECT_NEAR(contact.patches[0].point[0].gap, -1e-4, kExact) << shape.index() << ", " << n;
    }
  }
}

TEST(NarrowPhaseTest, AHullOfManyCornersStandsOnAFace) {
  ConvexHull drum;
  for (int n = 0; n < 48; ++n) {
    for (const double z : {-0.5, 0.5})
      drum.points.push_back({0.5 * std::cos(n * M_PI / 24), 0.5 * std::sin(n * M_PI / 24), z});
  }
  const TriangleMesh quad{{{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0}}, {0, 1, 2, 0, 2, 3}};
  const std::pair<Geometry, Scalar> grounds[] = {{Plane{}, 0}, {tessera::Box{{8, 8, 2}}, -1}, {quad, 0}};
  for (const auto& [ground, height] : grounds) {
    NarrowPhase phase;
    const Body floor = body(1, ground, {0, 0, height}, Motion::kStatic);
    const Body standing = body(2, drum, {Scalar(0.3), Scalar(0.1), Scalar(0.499)});
    Contact contact;
    phase.update(floor, standing, contact);
    ASSERT_EQ(contact.patches.size(), 1u) << ground.index();
    EXPECT_GE(contact.patches[0].count, 3) << ground.index();
    EXPECT_NEAR(contact.patches[0].normal.z(), -1, 1e-3) << ground.index();
  }
}

// Cores round edges and corners off by a margin, some centimetres of shapes of this size.
TEST(NarrowPhaseTest, CornersAndRimsTouchWhereTheyAre) {
  ConvexHull drum;
  for (int n = 0; n < 48; ++n) {
    for (const double z : {-0.5, 0.5})
      drum.points.push_back({0.5 * std::cos(n * M_PI / 24), 0.5 * std::sin(n * M_PI / 24), z});
  }
  const std::pair<Geometry, Scalar> grounds[] = {
      {Plane{}, 0}, {tessera::Box{{8, 8, 2}}, -1}, {Cylinder{4, 2}, -1}};
  const Geometry shapes[] = {tessera::Box{}, Cylinder{0.5, 1}, drum};
  for (const auto& [ground, height] : grounds) {
    const Body floor = body(1, ground, {0, 0, height}, Motion::kStatic);
    for (const Geometry& shape : shapes) {
      for (const Scalar tilt : {Scalar(0.3), Scalar(0.6), Scalar(0.9), Scalar(1.3)}) {
        Body tilted = body(2, shape, Vector::Zero());
        tilted.pose.rotation = (Eigen::AngleAxis<Scalar>(tilt, Vector(2, 1, 0).normalized()) *
                                Eigen::AngleAxis<Scalar>(Scalar(0.4), Vector::UnitZ()))
                                   .toRotationMatrix();
        const Vector down = tilted.pose.rotation.transpose() * -Vector::UnitZ();
        const Scalar reach = farthest(tilted.solid->parts()[0], down).dot(down);
        tilted.pose.position.z() = reach - Scalar(0.005);
        NarrowPhase phase;
        Contact contact;
        phase.update(floor, tilted, contact);
        const std::string where =
            testing::PrintToString(std::tuple(ground.index(), shape.index(), double(tilt)));
        ASSERT_EQ(contact.patches.size(), 1u) << where;
        Scalar least = 1;
        for (int n = 0; n < contact.patches[0].count; ++n)
          least = std::min(least, contact.patches[0].point[n].gap);
        EXPECT_NEAR(least, -0.005, 0.0011) << where;
        EXPECT_NEAR(contact.patches[0].normal.z(), -1, 1e-3) << where;
      }
    }
  }
}

// Of shapes that are deeper in each other, EPA does not always find the least depth.
TEST(NarrowPhaseTest, NoOverlapIsDeeperThanTwoShapesReach) {
  const Body box = body(1, tessera::Box{}, Vector::Zero());
  Body cylinder = body(2, Cylinder{0.5, 1}, Vector::Zero());
  const Scalar reach = box.solid->radius() + cylinder.solid->radius();
  std::minstd_rand dice(1);
  const auto number = [&] { return Scalar(dice()) / Scalar(std::minstd_rand::max()) * 2 - 1; };
  for (int n = 0; n < 2000; ++n) {
    const Vector direction = Vector(number(), number(), number()).normalized();
    const Scalar distance = reach * Scalar(0.85 + 0.15 * number());
    cylinder.pose.position = direction * distance;
    cylinder.pose.rotation =
        Eigen::Quaternion<Scalar>(number(), number(), number(), number()).normalized().toRotationMatrix();
    NarrowPhase phase;
    Contact contact;
    phase.update(box, cylinder, contact);
    for (const ContactPatch& patch : contact.patches) {
      for (int point = 0; point < patch.count; ++point)
        EXPECT_GT(patch.point[point].gap, distance - reach - Scalar(0.01)) << n;
    }
  }
}

TEST(NarrowPhaseTest, WhatIsSaidNotToTouchHasNoPoints) {
  ConvexHull wedge{{{0, 0, 0}, {1, 0, 0}, {0, 0.7, 0}, {0, 0, 0.4}, {0.6, 0.5, 0.3}}};
  const Geometry shapes[] = {Sphere{0.4},
                             Capsule{0.2, 0.8},
                             tessera::Box{{0.6, 0.8, 1}},
                             Cylinder{0.4, 0.9},
                             wedge,
                             tessera::Ellipsoid{{0.3, 0.4, 0.6}}};
  std::minstd_rand dice(3);
  const auto number = [&] { return Scalar(dice()) / Scalar(std::minstd_rand::max()) * 2 - 1; };
  int apart = 0;
  for (const Geometry& shape_a : shapes) {
    for (const Geometry& shape_b : shapes) {
      Body a = body(1, shape_a, Vector::Zero());
      Body b = body(2, shape_b, Vector::Zero());
      for (int n = 0; n < 200; ++n) {
        b.pose.position = Vector(number(), number(), number()) * Scalar(1.3);
        for (Body* turned : {&a, &b}) {
          turned->pose.rotation = Eigen::Quaternion<Scalar>(number(), number(), number(), number())
                                      .normalized()
                                      .toRotationMatrix();
        }
        if (NarrowPhase::may_touch(a, b)) continue;
        ++apart;
        NarrowPhase phase;
        Contact contact;
        phase.update(a, b, contact);
        EXPECT_TRUE(contact.patches.empty()) << shape_a.index() << ", " << shape_b.index() << ", " << n;
      }
    }
  }
  EXPECT_GT(apart, 1000);
}

TEST(NarrowPhaseTest, ImpulsesStayWithTheirFeatures) {
  NarrowPhase phase;
  const Body floor = body(1, tessera::Box{{8, 8, 2}}, {0, 0, -1}, Motion::kStatic);
  Body box = body(2, tessera::Box{}, {0, 0, Scalar(0.499)});
  Contact contact;
  phase.update(floor, box, contact);
  ASSERT_EQ(contact.patches[0].count, 4);
  for (int n = 0; n < 4; ++n) {
    const Vector& corner = contact.patches[0].point[n].on_b;
    contact.patches[0].point[n].impulse = corner.x() + 2 * corner.y() + 3;
  }
  contact.patches[0].friction_impulse = {Scalar(0.5), 0, 0};
  // Far enough for the points to be found anew.
  for (const Scalar way : {Scalar(0.001), Scalar(0.1), Scalar(0.2)}) {
    box.pose.position.x() = way;
    phase.update(floor, box, contact);
    ASSERT_EQ(contact.patches.size(), 1u);
    ASSERT_EQ(contact.patches[0].count, 4);
    EXPECT_EQ(contact.patches[0].friction_impulse.x(), Scalar(0.5));
    for (int n = 0; n < 4; ++n) {
      const Vector& corner = contact.patches[0].point[n].on_b;
      EXPECT_NEAR(contact.patches[0].point[n].impulse, corner.x() + 2 * corner.y() + 3, kExact) << way;
    }
  }
}

TEST(NarrowPhaseTest, PointsThatAreMovedAlongHaveTheGapsOfPointsFoundAnew) {
  const Body floor = body(1, tessera::Box{{8, 8, 2}}, {0, 0, -1}, Motion::kStatic);
  Body box = body(2, tessera::Box{}, {0, 0, Scalar(0.5)});
  NarrowPhase phase;
  Contact moved;
  phase.update(floor, box, moved);
  for (int n = 1; n <= 5; ++n) {
    box.pose.position.z() = Scalar(0.5) + Scalar(0.001) * Scalar(n);
    Contact fresh;
    phase.update(floor, box, moved);
    phase.update(floor, box, fresh);
    ASSERT_EQ(moved.patches[0].count, fresh.patches[0].count);
    for (int p = 0; p < 4; ++p) EXPECT_NEAR(moved.patches[0].point[p].gap, Scalar(0.001) * Scalar(n), kExact);
  }
}

TEST(NarrowPhaseTest, BallsOnARidgeArePushedBetweenItsSides) {
  NarrowPhase phase;
  const Body ground = body(1, ridge(), {0, 0, 0}, Motion::kStatic);
  const Body ball = body(2, Sphere{0.5}, {0, Scalar(0.3), Scalar(1.49)});
  Contact contact;
  phase.update(ground, ball, contact);
  ASSERT_FALSE(contact.patches.empty());
  for (const ContactPatch& patch : contact.patches) {
    EXPECT_LT(patch.normal.z(), Scalar(-0.7)) << "from the ball to the ground";
    EXPECT_NEAR(patch.point[0].gap, -0.01, 1e-4);
  }
}

TEST(NarrowPhaseTest, ABallThatRollsOverAFlatSurfaceMeetsNoEdge) {
  NarrowPhase phase;
  const HeightField flat{9, 9, {1, 1}, std::vector<double>(81, 0)};
  const Body ground = body(1, flat, {0, 0, 0}, Motion::kStatic);
  Body ball = body(2, Sphere{0.5}, {-3, Scalar(-2.9), Scalar(0.495)});
  for (int n = 0; n < 200; ++n) {
    ball.pose.position += Vector(Scalar(0.029), Scalar(0.027), 0);
    Contact contact;
    phase.update(ground, ball, contact);
    ASSERT_EQ(contact.patches.size(), 1u) << n;
    EXPECT_NEAR(contact.patches[0].normal.z(), -1, kExact) << n;
    EXPECT_NEAR(contact.patches[0].point[0].gap, -0.005, kExact) << n;
  }
}

// Not quite along the cells, and a little tilted, it would have others beside its line.
TEST(NarrowPhaseTest, ACapsuleOnManyTrianglesHasTheEndsOfItsLine) {
  const Body floor =
      body(1, HeightField{33, 33, {0.25, 0.25}, std::vector<double>(33 * 33, 0)}, {0, 0, 0}, Motion::kStatic);
  const Capsule capsule{0.15, 0.6};
  for (int step = 0; step < 40; ++step) {
    Body lying = body(2, capsule, {Scalar(0.0093 * step), Scalar(0.05), Scalar(0.1498)});
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(M_PI / 2 + 2e-4, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(1e-3 * step, Eigen::Vector3d::UnitY());
    lying.pose.rotation = turn.toRotationMatrix().cast<Scalar>();
    Contact contact;
    NarrowPhase().update(floor, lying, contact);
    ASSERT_EQ(contact.patches.size(), 1u) << step;
    const ContactPatch& patch = contact.patches[0];
    ASSERT_EQ(patch.count, 2) << step;
    for (int n = 0; n < 2; ++n) EXPECT_NEAR(std::abs(patch.point[n].on_b.z()), 0.3, 1e-3) << step;
  }
}

TEST(NarrowPhaseTest, DistancesAreThoseBetweenSurfaces) {
  const Solid ball(Shape{{ShapePart{Sphere{0.5}, {}}}}, Pose{}, false);
  const Solid box(Shape{{ShapePart{tessera::Box{}, {}}}}, Pose{}, false);
  const Solid plane(Shape{{ShapePart{Plane{}, {}}}}, Pose{}, true);
  const Frame above{Matrix::Identity(), {0, 0, Scalar(1.25)}};
  EXPECT_NEAR(NarrowPhase::distance(ball, above, box, {}, 1), 0.25, 1e-4);
  EXPECT_NEAR(NarrowPhase::distance(ball, above, plane, {}, 1), 0.75, 1e-4);
  EXPECT_GT(NarrowPhase::distance(ball, above, box, {}, Scalar(0.1)), Scalar(0.1));
}

}  // namespace
}  // namespace tessera::native
