// Rays against references in long double that share nothing with the closed forms: bisection of an implicit
// function of the shape along the ray, and the normal of the surface at the place found.
#include "lpss/collision/ray.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lpss/collision/convex_hull.h"

namespace tessera::collision {
namespace {

using Real = long double;
using Vector = Eigen::Matrix<Real, 3, 1>;
using Meet = std::function<std::optional<RayContact>(const Ray&)>;
// < 0 inside, convex along any line, and grows as fast as the distance near the surface.
using Depth = std::function<Real(const Vector&)>;

constexpr int kRays = 100'000;

// The least value along the ray, by golden sections, then the first zero before it, by bisection.
std::optional<Real> first_inside(const Depth& depth, const Ray& ray) {
  const Vector from = ray.from.cast<Real>();
  const Vector way = ray.way.cast<Real>();
  const auto at = [&](Real t) { return depth(from + t * way); };
  Real low = 0;
  Real high = 1;
  const Real share = (std::sqrt(Real(5)) - 1) / 2;
  for (int n = 0; n < 60; ++n) {
    const Real a = high - share * (high - low);
    const Real b = low + share * (high - low);
    (at(a) < at(b) ? high : low) = at(a) < at(b) ? b : a;
  }
  Real in = (low + high) / 2;
  if (at(in) > 0) return std::nullopt;
  Real out = 0;
  for (int n = 0; n < 70; ++n) {
    const Real t = (in + out) / 2;
    (at(t) > 0 ? out : in) = t;
  }
  return in;
}

Vector gradient(const Depth& depth, const Vector& at) {
  const Real step = 1e-6L;
  Vector result;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector way = step * Vector::Unit(axis);
    result[axis] = depth(at + way) - depth(at - way);
  }
  return result.normalized();
}

struct Errors {
  Real place = 0;   // m, along the normal
  Real normal = 0;  // rad, away from edges
  int hits = 0;
};

// Rays from around a shape of about a metre, at it; those that graze it by less than rounding count neither
// way.
Errors errors_of(const Meet& meet, const Depth& depth) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  Errors errors;
  for (int n = 0; n < kRays; ++n) {
    Ray ray;
    ray.from = draw().normalized() * (2 + 3 * std::abs(normal(random)));
    ray.way = 2 * (0.4 * draw() - ray.from);
    const std::optional<Real> right = first_inside(depth, ray);
    const std::optional<RayContact> got = meet(ray);
    if (right.has_value() != got.has_value()) {
      // Only where the ray touches and no more.
      Real least = std::numeric_limits<Real>::max();
      for (int k = 0; k <= 4000; ++k)
        least =
            std::min(least, std::abs(depth(ray.from.cast<Real>() + Real(k) / 4000 * ray.way.cast<Real>())));
      EXPECT_LT(least, 1e-3L) << "ray " << n << " is met: " << right.has_value();
      continue;
    }
    if (!right) continue;
    ++errors.hits;
    const Vector place = ray.from.cast<Real>() + *right * ray.way.cast<Real>();
    const Vector along = gradient(depth, place);
    const Real slope = std::abs(along.dot(ray.way.cast<Real>()));
    errors.place = std::max(errors.place, std::abs(Real(got->t) - *right) * slope);
    EXPECT_NEAR(got->normal.norm(), 1, 1e-12);
    EXPECT_LE(got->normal.dot(ray.way), 1e-9);
    const Real turn = got->normal.cast<Real>().cross(along).norm();
    const bool is_at_edge =
        std::abs(gradient(depth, place + 1e-5L * Vector(1, 2, 3)).dot(along) - 1) > 1e-6L ||
        std::abs(gradient(depth, place - 1e-5L * Vector(3, 1, 2)).dot(along) - 1) > 1e-6L;
    if (!is_at_edge) errors.normal = std::max(errors.normal, turn);
  }
  return errors;
}

void expect_exact(const Meet& meet, const Depth& depth) {
  const Errors errors = errors_of(meet, depth);
  EXPECT_GT(errors.hits, kRays / 10);
  EXPECT_LT(errors.place, 1e-14L);
  EXPECT_LT(errors.normal, 1e-8L) << "of the reference: differences over a micrometre";
  testing::Test::RecordProperty("place_m", std::to_string(static_cast<double>(errors.place) * 1e15) + "e-15");
  testing::Test::RecordProperty("normal_rad",
                                std::to_string(static_cast<double>(errors.normal) * 1e15) + "e-15");
}

TEST(RayTest, BallIsExact) {
  expect_exact([](const Ray& ray) { return meet_ball(ray, 0.7); },
               [](const Vector& p) { return p.norm() - Real(0.7); });
}

TEST(RayTest, BoxIsExact) {
  const Eigen::Vector3d half(0.5, 0.3, 0.8);
  expect_exact([&](const Ray& ray) { return meet_box(ray, half); },
               [&](const Vector& p) { return (p.cwiseAbs() - half.cast<Real>()).maxCoeff(); });
}

TEST(RayTest, CapsuleIsExact) {
  const auto depth = [](const Vector& p) {
    const Real beyond = std::max(std::abs(p.z()) - Real(0.6), Real(0));
    return std::sqrt(p.x() * p.x() + p.y() * p.y() + beyond * beyond) - Real(0.3);
  };
  expect_exact([](const Ray& ray) { return meet_capsule(ray, 0.3, 0.6); }, depth);
}

TEST(RayTest, CylinderIsExact) {
  const auto depth = [](const Vector& p) {
    return std::max(std::hypot(p.x(), p.y()) - Real(0.5), std::abs(p.z()) - Real(0.4));
  };
  expect_exact([](const Ray& ray) { return meet_cylinder(ray, 0.5, 0.4); }, depth);
}

TEST(RayTest, EllipsoidIsExact) {
  const Eigen::Vector3d radii(0.5, 0.3, 0.8);
  const auto depth = [&](const Vector& p) {
    const Vector radius = radii.cast<Real>();
    const Vector scaled = p.cwiseQuotient(radius);
    const Real length = scaled.norm();
    return length > 0 ? (length - 1) * length / scaled.cwiseQuotient(radius).norm() : -radius.minCoeff();
  };
  expect_exact([&](const Ray& ray) { return meet_ellipsoid(ray, radii); }, depth);
}

TEST(RayTest, HullIsExact) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points;
  for (int n = 0; n < 24; ++n)
    points.push_back(Eigen::Vector3d(normal(random), normal(random), normal(random)) * 0.4);
  const HullTriangles hull = convex_hull(points);
  const std::vector<HalfSpace<double>> planes = planes_of(hull);
  // The reference has its normals from the corners, too, but in its own numbers.
  std::vector<std::pair<Vector, Vector>> sides;
  for (const std::vector<int>& t : hull.triangles) {
    const auto corner = [&](std::size_t k) -> Vector {
      return hull.vertices[static_cast<std::size_t>(t[k])].cast<Real>();
    };
    const Vector out = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    sides.emplace_back(out, corner(0));
  }
  const auto depth = [&](const Vector& p) {
    Real most = std::numeric_limits<Real>::lowest();
    for (const auto& [out, corner] : sides) most = std::max(most, out.dot(p - corner));
    return most;
  };
  expect_exact([&](const Ray& ray) { return meet_planes(ray, planes); }, depth);
}

struct NamedMeet {
  const char* name;
  Meet meet;
};

// All with the half length 0.5 along x, y and z.
std::vector<NamedMeet> solids() {
  static const std::vector<HalfSpace<double>> cube = [] {
    std::vector<Eigen::Vector3d> corners;
    for (int n = 0; n < 8; ++n)
      corners.push_back({n & 1 ? 0.5 : -0.5, n & 2 ? 0.5 : -0.5, n & 4 ? 0.5 : -0.5});
    return planes_of(convex_hull(corners));
  }();
  return {{"ball", [](const Ray& ray) { return meet_ball(ray, 0.5); }},
          {"box", [](const Ray& ray) { return meet_box(ray, Eigen::Vector3d::Constant(0.5)); }},
          {"capsule", [](const Ray& ray) { return meet_capsule(ray, 0.5, 0.); }},
          {"long capsule", [](const Ray& ray) { return meet_capsule(ray, 0.25, 0.25); }},
          {"cylinder", [](const Ray& ray) { return meet_cylinder(ray, 0.5, 0.5); }},
          {"ellipsoid", [](const Ray& ray) { return meet_ellipsoid(ray, Eigen::Vector3d::Constant(0.5)); }},
          {"hull", [](const Ray& ray) { return meet_planes(ray, cube); }}};
}

TEST(RayTest, AlongAxesSolidsAreMetWhereTheyAre) {
  for (const auto& [name, meet] : solids()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1., 1.}) {
        const Eigen::Vector3d out = side * Eigen::Vector3d::Unit(axis);
        const double half = std::string_view(name) == "long capsule" && axis != 2 ? 0.25 : 0.5;
        const auto contact = meet({2 * out, -4 * out});
        ASSERT_TRUE(contact) << name << " " << axis;
        EXPECT_DOUBLE_EQ(contact->t, (2 - half) / 4) << name;
        EXPECT_EQ(contact->normal, out) << name;
        EXPECT_FALSE(meet({2 * out, 4 * out})) << name << ": it goes away";
        EXPECT_FALSE(meet({2 * out, -(2 - half - 1e-9) * out})) << name << ": it ends before";
        EXPECT_TRUE(meet({2 * out, -(2 - half + 1e-9) * out})) << name;
        EXPECT_TRUE(meet({half * out, -out})) << name << ": it begins on the surface, and goes inwards";
        EXPECT_FALSE(meet({half * out, out})) << name << ": it begins on the surface, and goes away";
      }
    }
  }
}

TEST(RayTest, FromInsideSolidsAreNotMet) {
  for (const auto& [name, meet] : solids()) {
    for (const Eigen::Vector3d& from : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.1, 0, 0.2)}) {
      for (const Eigen::Vector3d& way : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0, 2),
                                         Eigen::Vector3d(-1, 2, 3), Eigen::Vector3d(0.01, 0, -0.01)})
        EXPECT_FALSE(meet({from, way})) << name;
    }
  }
}

TEST(RayTest, WhatIsNoRayMeetsNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& [name, meet] : solids()) {
    EXPECT_FALSE(meet({{0, 0, 2}, {0, 0, 0}})) << name;
    EXPECT_FALSE(meet({{0, 0, 0.5}, {0, 0, 0}})) << name;
    EXPECT_FALSE(meet({{nan, 0, 2}, {0, 0, -4}})) << name;
    EXPECT_FALSE(meet({{0, 0, 2}, {0, nan, -4}})) << name;
    EXPECT_FALSE(meet({{0, 0, 2}, {0, 0, -infinity}})) << name;
    EXPECT_FALSE(meet({{0, 0, infinity}, {0, 0, -4}})) << name;
  }
}

TEST(RayTest, FromFarAwayTheyAreMetAsExactlyAsNumbersAllow) {
  for (const auto& [name, meet] : solids()) {
    const Eigen::Vector3d out = Eigen::Vector3d(1, 2, 3).normalized();
    const auto near = meet({2 * out, -4 * out});
    double moved = 0;
    const Ray far = Ray{1e6 * out, -2e6 * out}.beside(Eigen::Vector3d::Zero(), moved);
    const auto contact = meet(far);
    ASSERT_TRUE(near && contact) << name;
    EXPECT_NEAR(1e6 - 2e6 * (contact->t + moved), 2 - 4 * near->t, 1e-9) << name;
    EXPECT_NEAR((contact->normal - near->normal).norm(), 0, 1e-9) << name;
  }
}

TEST(RayTest, TouchesRoundShapesAndPassesBesideThem) {
  for (const auto& [name, meet] : solids()) {
    if (std::string_view(name) == "long capsule") continue;
    EXPECT_TRUE(meet({{-2, 0, 0.5}, {4, 0, 0}})) << name;
    EXPECT_FALSE(meet({{-2, 0, 0.5 + 1e-9}, {4, 0, 0}})) << name;
    EXPECT_TRUE(meet({{-2, 0, 0.5 - 1e-9}, {4, 0, 0}})) << name;
  }
  const auto touch = meet_ball({{-2, 0, 0.5}, {4, 0, 0}}, 0.5);
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->normal, Eigen::Vector3d::UnitZ());
}

TEST(RayTest, SurfacesAreMetFromBothSides) {
  const HalfSpace<double> floor{Eigen::Vector3d::UnitZ(), 1};
  const std::array<Eigen::Vector3d, 3> triangle{Eigen::Vector3d(-1, -1, 1), {1, -1, 1}, {0, 1, 1}};
  for (const double side : {-1., 1.}) {
    const Ray ray{{0, 0, 1 + side}, {0, 0, -4 * side}};
    const Eigen::Vector3d out(0, 0, side);
    for (const auto& contact : {meet_surface(ray, floor), meet_triangle(ray, triangle)}) {
      ASSERT_TRUE(contact);
      EXPECT_DOUBLE_EQ(contact->t, 0.25);
      EXPECT_EQ(contact->normal, out);
    }
    EXPECT_FALSE(meet_surface({ray.from, -ray.way}, floor));
    EXPECT_FALSE(meet_triangle({ray.from, -ray.way}, triangle));
  }
  EXPECT_FALSE(meet_surface({{0, 0, 2}, {1, 0, 0}}, floor));
  EXPECT_FALSE(meet_triangle({{2, 0, 2}, {0, 0, -4}}, triangle));
}

// A fan of triangles around a point, and rays at the edges that they share.
TEST(RayTest, NoRayPassesBetweenTriangles) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> between(-1, 1);
  for (int n = 0; n < 10'000; ++n) {
    const auto draw = [&] {
      return Eigen::Vector3d(between(random), between(random), 0.1 * between(random));
    };
    const Eigen::Vector3d a = draw();
    const Eigen::Vector3d b = draw();
    const Eigen::Vector3d left = (a + b) / 2 + Eigen::Vector3d(a.y() - b.y(), b.x() - a.x(), 0);
    const Eigen::Vector3d right = (a + b) / 2 - Eigen::Vector3d(a.y() - b.y(), b.x() - a.x(), 0);
    const Eigen::Vector3d at = a + (b - a) * (0.5 + 0.49 * between(random));
    const Eigen::Vector3d from(between(random), between(random), 3);
    const Ray ray{from, 2 * (at - from)};
    EXPECT_TRUE(meet_triangle(ray, {a, b, left}) || meet_triangle(ray, {b, a, right})) << n;
  }
}

}  // namespace
}  // namespace tessera::collision
