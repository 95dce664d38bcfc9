// The distance of two convex shapes, and how deep they are in each other: both are the greatest separation
// along any direction.
#include "lpss/collision/closest.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace tessera::collision {
namespace {

template <typename Scalar>
class ClosestTest : public testing::Test {
 protected:
  using Vector = Vector3<Scalar>;
  using Kind = typename Core<Scalar>::Kind;

  static constexpr Scalar kExact = sizeof(Scalar) == sizeof(float) ? Scalar(2e-5) : Scalar(1e-7);

  static Core<Scalar> ball(double radius) { return {Kind::kPoint, Vector::Zero(), Scalar(radius)}; }
  static Core<Scalar> capsule(double radius, double half) {
    return {Kind::kSegment, Vector(0, 0, Scalar(half)), Scalar(radius)};
  }
  static Core<Scalar> box(double x, double y, double z, double margin) {
    return {Kind::kBox, Eigen::Vector3d(x, y, z).cast<Scalar>(), Scalar(margin)};
  }
  static Core<Scalar> cylinder(double radius, double half, double margin) {
    return {Kind::kCylinder, Eigen::Vector3d(radius, radius, half).cast<Scalar>(), Scalar(margin)};
  }
  static Core<Scalar> ellipsoid(double x, double y, double z, double margin) {
    return {Kind::kEllipsoid, Eigen::Vector3d(x, y, z).cast<Scalar>(), Scalar(margin)};
  }

  Matrix3<Scalar> turn(double angle, double x, double y, double z) const {
    return Eigen::AngleAxisd(angle, Eigen::Vector3d(x, y, z).normalized()).toRotationMatrix().cast<Scalar>();
  }

  static std::optional<Closest<Scalar>> find(const Core<Scalar>& a, const Core<Scalar>& b,
                                             const Placement<Scalar>& placement, double reach,
                                             const Vector& before = Vector::Zero()) {
    return closest<Scalar>(a, b, placement, Scalar(reach), before);
  }

  // m, of the shapes, along a direction from b to a.
  static Scalar separation(const Core<Scalar>& a, const Core<Scalar>& b, const Placement<Scalar>& placement,
                           const Vector& direction) {
    const PlacedCore<Scalar> of_a(a, placement.a, Vector::Zero());
    const PlacedCore<Scalar> of_b(b, placement.b, placement.offset);
    const Vector down = -direction;
    return direction.dot(of_a.support(down) - of_b.support(direction)) - a.margin - b.margin -
           of_a.rounded_off(down) - of_b.rounded_off(direction);
  }
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(ClosestTest, Scalars);

TYPED_TEST(ClosestTest, KnownDistances) {
  const Matrix3<TypeParam> level = Matrix3<TypeParam>::Identity();
  const Matrix3<TypeParam> lying = this->turn(std::numbers::pi / 2, 1, 0, 0);
  const auto cylinder = this->cylinder(0.5, 1, 0.04);
  const auto at = [](double x, double y, double z) -> Vector3<TypeParam> {
    return Eigen::Vector3d(x, y, z).cast<TypeParam>();
  };
  const struct {
    std::string name;
    Core<TypeParam> a;
    Core<TypeParam> b;
    Placement<TypeParam> placement;
    double gap;
    Vector3<TypeParam> normal;
  } cases[] = {
      {"balls", this->ball(1), this->ball(0.5), {level, level, at(0, 3, 4)}, 3.5, at(0, -0.6, -0.8)},
      {"balls in each other",
       this->ball(1),
       this->ball(0.5),
       {level, level, at(0, 0, 1)},
       -0.5,
       at(0, 0, -1)},
      {"caps", cylinder, cylinder, {level, level, at(0.2, 0.1, -2.01)}, 0.01, at(0, 0, 1)},
      {"caps in each other", cylinder, cylinder, {level, level, at(0.2, 0.1, -1.99)}, -0.01, at(0, 0, 1)},
      {"caps deep in each other",
       cylinder,
       cylinder,
       {level, level, at(0.05, 0.02, -1.7)},
       -0.3,
       at(0, 0, 1)},
      {"sides", cylinder, cylinder, {level, level, at(1.02, 0, 0.3)}, 0.02, at(-1, 0, 0)},
      {"crossing sides", cylinder, cylinder, {level, lying, at(-0.98, 0.2, 0.3)}, -0.02, at(1, 0, 0)},
      {"a tilted rim beside a side",
       cylinder,
       this->cylinder(0.3, 0.4, 0.03),
       {level, this->turn(std::numbers::pi / 4, 0, 1, 0), at(0.52 + 0.7 * std::numbers::sqrt2 / 2, 0, 0.1)},
       0.02,
       at(-1, 0, 0)},
      {"rims",
       this->cylinder(0.5, 1, 1e-5),
       this->cylinder(0.5, 1, 1e-5),
       {level, level, at(1.06, 0, 2.08)},
       0.1,
       at(-0.6, 0, -0.8)},
      {"a cylinder on a box",
       cylinder,
       this->box(2, 2, 1, 0.04),
       {level, level, at(0.4, 0.3, -2.02)},
       0.02,
       at(0, 0, 1)},
      {"an ellipsoid on its tip",
       this->ellipsoid(0.3, 0.4, 0.5, 0.03),
       this->box(2, 2, 1, 0.04),
       {level, level, at(0.4, 0.3, -1.51)},
       0.01,
       at(0, 0, 1)},
      {"a capsule beside a cylinder",
       this->capsule(0.2, 0.5),
       cylinder,
       {level, level, at(0, 0.73, 0.2)},
       0.03,
       at(0, -1, 0)},
  };
  for (const auto& [name, a, b, placement, gap, normal] : cases) {
    const auto found = this->find(a, b, placement, 4);
    ASSERT_TRUE(found) << name;
    EXPECT_NEAR(found->gap, gap, 2 * this->kExact) << name;
    EXPECT_NEAR((found->normal - normal).norm(), 0, 2e-3) << name << ": " << found->normal.transpose();
    EXPECT_NEAR((found->on_a - found->on_b).dot(found->normal), found->gap, this->kExact) << name;
    const Vector3<TypeParam> near = (normal + at(0.1, -0.2, 0.1)).normalized();
    const auto again = this->find(a, b, placement, 4, near);
    ASSERT_TRUE(again) << name;
    EXPECT_NEAR(again->gap, gap, 2 * this->kExact) << name;
    EXPECT_EQ(this->find(a, b, placement, std::max(0.0, gap - 1e-3)).has_value(), gap < 0) << name;
  }
}

// A margin of a millimetre, so that what is rounded off hardly matters.
TYPED_TEST(ClosestTest, NoDirectionSeparatesMore) {
  using Scalar = TypeParam;
  constexpr double kMargin = 1e-3;
  std::vector<Vector3<Scalar>> corners;
  for (int n = 0; n < 7; ++n) {
    corners.push_back(Vector3<Scalar>(Scalar(0.5 * std::cos(n * 0.9)), Scalar(0.4 * std::sin(n * 0.9)),
                                      Scalar(n % 2 ? 0.3 : -0.4)));
  }
  Core<Scalar> points{Core<Scalar>::Kind::kPoints, Vector3<Scalar>::Zero(), 0, corners, corners};
  const std::vector<Core<Scalar>> shapes = {this->ball(0.4),
                                            this->capsule(0.2, 0.5),
                                            this->box(0.6, 0.4, 0.3, kMargin),
                                            this->cylinder(0.4, 0.5, kMargin),
                                            this->cylinder(0.6, 0.1, kMargin),
                                            this->ellipsoid(0.3, 0.4, 0.6, kMargin),
                                            points};
  std::mt19937 dice(5);
  const auto number = [&] { return double(dice()) / double(std::mt19937::max()) * 2 - 1; };
  const auto unit = [&] { return Eigen::Vector3d(number(), number(), number()).normalized().eval(); };
  const auto any_turn = [&] {
    return Eigen::Quaterniond(number(), number(), number(), number())
        .normalized()
        .toRotationMatrix()
        .template cast<Scalar>()
        .eval();
  };
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    for (std::size_t j = 0; j < shapes.size(); ++j) {
      for (int n = 0; n < 60; ++n) {
        const std::string where = testing::PrintToString(std::tuple(i, j, n));
        const Placement<Scalar> placement{
            any_turn(), any_turn(), (unit() * (0.2 + 0.8 * std::abs(number()))).template cast<Scalar>()};
        const auto found = this->find(shapes[i], shapes[j], placement, 10);
        ASSERT_TRUE(found) << where;
        EXPECT_NEAR(found->normal.norm(), 1, 1e-5) << where;
        EXPECT_NEAR(this->separation(shapes[i], shapes[j], placement, found->normal), found->gap,
                    4 * this->kExact + std::max(Scalar(0), -found->gap) * Scalar(1.5e-4))
            << where;
        Scalar most = std::numeric_limits<Scalar>::lowest();
        for (int k = 0; k < 400; ++k) {
          // Many around the one found.
          const double spread = k < 200 ? 10 : 0.1;
          const Vector3<Scalar> direction =
              (found->normal.template cast<double>() + spread * unit()).normalized().template cast<Scalar>();
          most = std::max(most, this->separation(shapes[i], shapes[j], placement, direction));
        }
        EXPECT_GE(found->gap, most - Scalar(2.5e-3)) << where;
      }
    }
  }
}

// Middles at the same place, and differences without a volume.
TYPED_TEST(ClosestTest, EveryOverlapHasADirection) {
  const Matrix3<TypeParam> level = Matrix3<TypeParam>::Identity();
  const Core<TypeParam> shapes[] = {this->ball(0.5), this->capsule(0.2, 0.5), this->box(0.5, 0.5, 0.5, 0.04),
                                    this->cylinder(0.5, 1, 0.04), this->ellipsoid(0.3, 0.4, 0.5, 0.02)};
  for (const auto& a : shapes) {
    for (const auto& b : shapes) {
      const auto found = this->find(a, b, {level, level, Vector3<TypeParam>::Zero()}, 0);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->normal.norm(), 1, 1e-5);
      EXPECT_LT(found->gap, -0.39) << int(a.kind) << " " << int(b.kind);
    }
  }
}

}  // namespace
}  // namespace tessera::collision
