#include "lpss/collision/collide.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "lpss/collision/test_shapes.h"

namespace tessera::collision {
namespace {

template <typename Scalar>
class Collide : public testing::Test {
 public:
  static constexpr Scalar kMargin = Scalar(0.02);
  // Of lengths about 1.
  static constexpr double kEqual = std::is_same_v<Scalar, float> ? 2e-6 : 1e-12;

  static Placement<Scalar> at(double x, double y, double z,
                              const Matrix3<Scalar>& b = Matrix3<Scalar>::Identity(),
                              const Matrix3<Scalar>& a = Matrix3<Scalar>::Identity()) {
    return {a, b, Vector3<Scalar>(Scalar(x), Scalar(y), Scalar(z))};
  }
  static double least_gap(const Manifold<Scalar>& manifold) {
    double least = std::numeric_limits<double>::max();
    for (int n = 0; n < manifold.count; ++n) least = std::min(least, double(manifold.point[n].gap));
    return least;
  }
  static std::set<std::uint32_t> features(const Manifold<Scalar>& manifold) {
    std::set<std::uint32_t> result;
    for (int n = 0; n < manifold.count; ++n) result.insert(manifold.point[n].feature);
    return result;
  }
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Collide, Scalars);

// What holds for every manifold of a pair: gaps match points, points are on both shapes, features are unique.
template <typename Scalar, typename A, typename B>
void check(const A& a, const B& b, const Placement<Scalar>& placement, Scalar margin,
           const Manifold<Scalar>& manifold) {
  const Cloud first = cloud(a).placed(placement.a.template cast<double>(), Eigen::Vector3d::Zero());
  const Cloud second =
      cloud(b).placed(placement.b.template cast<double>(), placement.offset.template cast<double>());
  const double size = first.extent() + second.extent();
  const double equal = size * (std::is_same_v<Scalar, float> ? 2e-6 : 1e-11);
  ASSERT_LE(manifold.count, 4);
  std::set<std::uint32_t> features;
  for (int n = 0; n < manifold.count; ++n) {
    const ContactPoint<Scalar>& p = manifold.point[n];
    const Eigen::Vector3d normal = manifold.normal.template cast<double>();
    EXPECT_NEAR(normal.norm(), 1, 1e-5);
    EXPECT_NEAR((p.on_a - p.on_b).template cast<double>().dot(normal), double(p.gap), equal);
    EXPECT_LE(p.gap, margin);
    EXPECT_TRUE(features.insert(p.feature).second) << "feature " << p.feature;
    // Within the slab of the shape along the normal, and near the surface that faces the other.
    EXPECT_GE(normal.dot(p.on_a.template cast<double>()), normal.dot(first.support(-normal)) - equal);
    EXPECT_LE(normal.dot(p.on_b.template cast<double>()), normal.dot(second.support(normal)) + equal);
  }
}

// Least penetration and distance against sampled support functions.
template <typename Scalar, typename A, typename B>
void check_against_samples(const A& a, const B& b, const Placement<Scalar>& placement, Scalar margin) {
  const Manifold<Scalar> manifold = collide(a, b, placement, margin);
  check(a, b, placement, margin, manifold);
  const Cloud first = cloud(a).placed(placement.a.template cast<double>(), Eigen::Vector3d::Zero());
  const Cloud second =
      cloud(b).placed(placement.b.template cast<double>(), placement.offset.template cast<double>());
  const double exact = separation_max(first, second);
  const double size = std::min(first.extent(), second.extent());
  const double tolerance = 0.01 * size;  // preferences among axes, and of sampling
  if (exact > margin + 1e-4 * size) {
    EXPECT_EQ(manifold.count, 0) << "apart by " << exact;
    return;
  }
  if (exact > margin - 1e-4 * size) return;
  ASSERT_GT(manifold.count, 0) << "apart by " << exact;
  const Eigen::Vector3d normal = manifold.normal.template cast<double>();
  double least = std::numeric_limits<double>::max();
  for (int n = 0; n < manifold.count; ++n) least = std::min(least, double(manifold.point[n].gap));
  if (exact > 0) {
    EXPECT_GE(least, exact - 1e-4 * size);  // no two points are closer
    EXPECT_LE(least, exact + 0.6 * double(margin) + tolerance);
  } else {
    EXPECT_GE(separation(first, second, normal), exact - tolerance);
    EXPECT_GE(least, exact - tolerance);
    EXPECT_LE(least, margin);
  }
}

template <typename Scalar>
class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Matrix3<Scalar> turn() {
    return rotation<Scalar>(number(0, 3.1), number(-1, 1), number(-1, 1), number(-1, 1) + 1e-3);
  }
  Placement<Scalar> placement(double reach) {
    const Eigen::Vector3d direction(number(-1, 1), number(-1, 1), number(-1, 1));
    const Eigen::Vector3d offset = direction.normalized() * number(0.05, 1) * reach;
    return {turn(), turn(), offset.cast<Scalar>()};
  }

 private:
  std::mt19937 random_;
};

template <typename Scalar, typename A, typename B>
void check_random(const A& a, const B& b, double reach, double margin, unsigned seed, int count = 150) {
  Random<Scalar> random(seed);
  for (int n = 0; n < count; ++n) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", pair " + std::to_string(n));
    check_against_samples<Scalar>(a, b, random.placement(reach), Scalar(margin));
    if (testing::Test::HasFailure()) return;
  }
}

TYPED_TEST(Collide, BoxOnBoxTouchesAtItsCorners) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> small{Vector(0.5, 0.5, 0.5)};
  const Box<TypeParam> large{Vector(2, 2, 1)};
  for (const double gap : {-0.01, 0.0, 0.01}) {
    const auto placement = this->at(0.1, 0.2, -(1.5 + gap));
    const auto manifold = collide(small, large, placement, this->kMargin);
    ASSERT_EQ(manifold.count, 4);
    EXPECT_NEAR((manifold.normal - Vector::UnitZ()).norm(), 0, this->kEqual);
    std::set<std::pair<int, int>> corners;
    for (const auto& p : manifold.point) {
      EXPECT_NEAR(p.gap, gap, this->kEqual);
      EXPECT_NEAR(p.on_a.z(), -0.5, this->kEqual);
      EXPECT_NEAR(p.on_b.z(), -0.5 - gap, this->kEqual);
      EXPECT_NEAR(std::abs(p.on_a.x()), 0.5, this->kEqual);
      EXPECT_NEAR(std::abs(p.on_a.y()), 0.5, this->kEqual);
      corners.insert({p.on_a.x() > 0, p.on_a.y() > 0});
    }
    EXPECT_EQ(corners.size(), 4u);
    check(small, large, placement, this->kMargin, manifold);
  }
}

TYPED_TEST(Collide, BoxesApartDoNotTouch) {
  const Box<TypeParam> box{Vector3<TypeParam>(0.5, 0.5, 0.5)};
  EXPECT_EQ(collide(box, box, this->at(0, 0, 1.03), this->kMargin).count, 0);
  EXPECT_EQ(collide(box, box, this->at(5, 3, 2, rotation<TypeParam>(1, 1, 2, 3)), this->kMargin).count, 0);
  // The diagonal distance counts.
  EXPECT_EQ(collide(box, box, this->at(0, 1.016, 1.016), this->kMargin).count, 0);
}

TYPED_TEST(Collide, CrossingEdgesOfBoxesTouchAtOnePoint) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> box{Vector(0.5, 0.5, 0.5)};
  const double half_diagonal = std::numbers::sqrt2 / 2;
  for (const double gap : {-0.02, 1e-4, 0.015}) {
    // Lower edge of a along x, upper edge of b along y.
    const auto placement =
        this->at(0.05, 0.1, -(2 * half_diagonal + gap), rotation<TypeParam>(std::numbers::pi / 4, 0, 1, 0),
                 rotation<TypeParam>(std::numbers::pi / 4, 1, 0, 0));
    const auto manifold = collide(box, box, placement, this->kMargin);
    ASSERT_EQ(manifold.count, 1);
    EXPECT_NEAR((manifold.normal - Vector::UnitZ()).norm(), 0, 1e-5);
    EXPECT_NEAR(manifold.point[0].gap, gap, 3 * this->kEqual);
    EXPECT_NEAR((manifold.point[0].on_a - Vector(TypeParam(0.05), 0, TypeParam(-half_diagonal))).norm(), 0,
                1e-5);
    check(box, box, placement, this->kMargin, manifold);
  }
}

TYPED_TEST(Collide, VertexOfABoxOnAFace) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> small{Vector(0.5, 0.5, 0.5)};
  const Box<TypeParam> large{Vector(2, 2, 1)};
  const Matrix3<TypeParam> on_tip =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(1, 1, 1), -Eigen::Vector3d::UnitZ())
          .toRotationMatrix()
          .cast<TypeParam>();
  const double tip = std::sqrt(0.75);
  for (const double gap : {-0.03, 0.01}) {
    const auto placement = this->at(0.1, 0.2, -(tip + 1 + gap), Matrix3<TypeParam>::Identity(), on_tip);
    const auto manifold = collide(small, large, placement, this->kMargin);
    ASSERT_GE(manifold.count, 1);
    EXPECT_NEAR(manifold.normal.z(), 1, 1e-6);
    EXPECT_NEAR(this->least_gap(manifold), gap, 3 * this->kEqual);
  }
}

TYPED_TEST(Collide, TrueDirectionsBetweenCorners) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> box{Vector(0.5, 0.5, 0.5)};
  const TypeParam gap(0.006);
  const auto corner = collide(box, box, this->at(1 + gap, 1 + gap, 1 + gap), this->kMargin);
  ASSERT_EQ(corner.count, 1);
  EXPECT_NEAR(corner.point[0].gap, gap * std::sqrt(3.0), 3 * this->kEqual);
  EXPECT_NEAR((corner.normal + Vector(1, 1, 1).normalized()).norm(), 0, 1e-3);
  const auto edge = collide(box, box, this->at(1 + gap, 1 + gap, 0.3), this->kMargin);
  ASSERT_EQ(edge.count, 1);
  EXPECT_NEAR(edge.point[0].gap, gap * std::sqrt(2.0), 3 * this->kEqual);
  EXPECT_NEAR((edge.normal + Vector(1, 1, 0).normalized()).norm(), 0, 1e-3);
}

TYPED_TEST(Collide, TiltedBoxKeepsFourPointsWithTheirGaps) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> box{Vector(0.5, 0.5, 0.5)};
  const Box<TypeParam> floor{Vector(50, 50, 0.5)};
  const auto placement =
      this->at(0, 0, -1, Matrix3<TypeParam>::Identity(), rotation<TypeParam>(1e-3, 0, 1, 0));
  const auto manifold = collide(box, floor, placement, this->kMargin);
  ASSERT_EQ(manifold.count, 4);
  for (const auto& p : manifold.point)
    EXPECT_NEAR(p.gap, p.on_a.x() > 0 ? -5e-4 : 5e-4, 5e-7 + 50 * this->kEqual);
}

TYPED_TEST(Collide, FeaturesOutlastSmallMotion) {
  const Box<TypeParam> box{Vector3<TypeParam>(0.5, 0.5, 0.5)};
  const Polyhedron<TypeParam> hull = cube_hull<TypeParam>(box.half);
  Random<TypeParam> random(3);
  for (const double yaw : {0.0, 0.3, std::numbers::pi / 4}) {
    std::set<std::uint32_t> first;
    for (int n = 0; n < 100; ++n) {
      const auto noise = [&] { return random.number(-1e-5, 1e-5); };
      const Matrix3<TypeParam> turned =
          rotation<TypeParam>(yaw, 0, 0, 1) * rotation<TypeParam>(noise(), noise(), 1, noise());
      const auto placement = this->at(noise(), noise(), -0.999 + noise(),
                                      Matrix3<TypeParam>(rotation<TypeParam>(1e-5, 1, noise(), 0) * turned));
      const auto manifold = collide(box, box, placement, this->kMargin);
      EXPECT_EQ(manifold.count, 4);
      if (first.empty()) first = this->features(manifold);
      EXPECT_EQ(this->features(manifold), first) << yaw;
      EXPECT_EQ(this->features(collide(box, hull, placement, this->kMargin)), first) << yaw;
      EXPECT_EQ(this->features(collide(hull, hull, placement, this->kMargin)), first) << yaw;
    }
  }
}

TYPED_TEST(Collide, DeepBoxesLeaveTheShortestWay) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> plank{Vector(1, 0.5, 0.1)};
  const auto manifold = collide(plank, plank, this->at(0.1, 0.1, 0.02), this->kMargin);
  ASSERT_EQ(manifold.count, 4);
  EXPECT_NEAR(manifold.normal.z(), -1, this->kEqual);
  EXPECT_NEAR(this->least_gap(manifold), -0.18, this->kEqual);
  const auto centred = collide(plank, plank, this->at(0, 0, 0), this->kMargin);
  EXPECT_EQ(centred.count, 4);
  EXPECT_NEAR(std::abs(centred.normal.z()), 1, this->kEqual);
}

TYPED_TEST(Collide, ExtremeSizes) {
  using Vector = Vector3<TypeParam>;
  const Box<TypeParam> crumb{Vector(5e-4, 5e-4, 5e-4)};
  const Box<TypeParam> slab{Vector(50, 50, 1)};
  const Box<TypeParam> card{Vector(0.05, 0.03, 2.5e-4)};
  for (const Box<TypeParam>& box : {crumb, card}) {
    for (const double turn : {0.0, 0.4, 2.0}) {
      const auto manifold =
          collide(box, slab,
                  this->at(20, -30, -(1 + double(box.half.z()) - 1e-5), rotation<TypeParam>(turn, 0, 0, 1)),
                  TypeParam(1e-3));
      ASSERT_EQ(manifold.count, 4);
      EXPECT_NEAR(manifold.normal.z(), 1, 1e-6);
      EXPECT_NEAR(this->least_gap(manifold), -1e-5, 100 * this->kEqual);
    }
    check_random<TypeParam>(box, box, 2.2 * box.half.norm(), 0.1 * box.half.z(), 5, 60);
  }
}

TYPED_TEST(Collide, BoxesAgainstSamples) {
  const Box<TypeParam> cube{Vector3<TypeParam>(0.5, 0.5, 0.5)};
  const Box<TypeParam> plank{Vector3<TypeParam>(1.2, 0.4, 0.2)};
  check_random<TypeParam>(cube, cube, 1.8, 0.05, 1, 300);
  check_random<TypeParam>(plank, cube, 2.0, 0.05, 2, 300);
}

TYPED_TEST(Collide, PolyhedraAgainstSamples) {
  const Box<TypeParam> cube{Vector3<TypeParam>(0.5, 0.5, 0.5)};
  const Polyhedron<TypeParam> six = prism<TypeParam>(6, 0.6, 0.4);
  const Polyhedron<TypeParam> four = tetrahedron<TypeParam>(0.5);
  check_random<TypeParam>(cube, six, 1.5, 0.05, 1);
  check_random<TypeParam>(six, six, 1.5, 0.05, 2);
  check_random<TypeParam>(six, four, 1.5, 0.05, 3);
  check_random<TypeParam>(four, cube, 1.7, 0.05, 4);
}

TYPED_TEST(Collide, RoundShapesAgainstSamples) {
  const Ball<TypeParam> ball{TypeParam(0.3)};
  const Capsule<TypeParam> capsule{TypeParam(0.2), TypeParam(0.5)};
  const Box<TypeParam> box{Vector3<TypeParam>(0.6, 0.4, 0.3)};
  const Polyhedron<TypeParam> six = prism<TypeParam>(6, 0.6, 0.4);
  check_random<TypeParam>(ball, ball, 0.7, 0.05, 1);
  check_random<TypeParam>(ball, capsule, 1.1, 0.05, 2);
  check_random<TypeParam>(ball, box, 1.2, 0.05, 3);
  check_random<TypeParam>(ball, six, 1.2, 0.05, 4);
  check_random<TypeParam>(capsule, capsule, 1.4, 0.05, 5);
  check_random<TypeParam>(capsule, box, 1.4, 0.05, 6);
  check_random<TypeParam>(capsule, six, 1.4, 0.05, 7);
  check_random<TypeParam>(box, capsule, 1.4, 0.05, 8);
}

TYPED_TEST(Collide, BallAtKnownPlaces) {
  using Vector = Vector3<TypeParam>;
  const Ball<TypeParam> ball{TypeParam(0.5)};
  const Capsule<TypeParam> capsule{TypeParam(0.25), TypeParam(1)};
  const Box<TypeParam> box{Vector(1, 1, 1)};
  const Polyhedron<TypeParam> hull = cube_hull<TypeParam>(box.half);
  auto manifold = collide(ball, ball, this->at(0, 0, -0.9), this->kMargin);
  ASSERT_EQ(manifold.count, 1);
  EXPECT_NEAR(manifold.point[0].gap, -0.1, this->kEqual);
  EXPECT_NEAR(manifold.normal.z(), 1, this->kEqual);
  EXPECT_EQ(collide(ball, ball, this->at(0, 0, 0), this->kMargin).count, 1);
  manifold = collide(ball, capsule, this->at(0.7, 0, 0.4), this->kMargin);
  ASSERT_EQ(manifold.count, 1);
  EXPECT_NEAR(manifold.point[0].gap, -0.05, this->kEqual);
  EXPECT_NEAR(manifold.normal.x(), -1, this->kEqual);
  // Centres inside leave through the nearest face.
  for (const auto& inside : {collide(ball, box, this->at(-0.8, 0.1, 0.2), this->kMargin),
                             collide(ball, hull, this->at(-0.8, 0.1, 0.2), this->kMargin)}) {
    ASSERT_EQ(inside.count, 1);
    EXPECT_NEAR(inside.normal.x(), 1, this->kEqual);
    EXPECT_NEAR(inside.point[0].gap, -0.7, this->kEqual);
    EXPECT_NEAR(inside.point[0].on_b.x(), 0.2, this->kEqual);
  }
}

TYPED_TEST(Collide, LyingCapsulesTouchAtTwoPoints) {
  using Vector = Vector3<TypeParam>;
  const Capsule<TypeParam> capsule{TypeParam(0.25), TypeParam(1)};
  const Box<TypeParam> box{Vector(0.6, 0.6, 0.6)};
  const Polyhedron<TypeParam> hull = cube_hull<TypeParam>(box.half);
  const Matrix3<TypeParam> lying = rotation<TypeParam>(std::numbers::pi / 2, 0, 1, 0);
  for (const double tilt : {0.0, 1e-3}) {
    const Matrix3<TypeParam> turn = rotation<TypeParam>(tilt, 0, 1, 0) * lying;
    const auto placement = this->at(0.1, 0, -0.845, Matrix3<TypeParam>::Identity(), turn);
    for (const auto& manifold : {collide(capsule, box, placement, this->kMargin),
                                 collide(capsule, hull, placement, this->kMargin)}) {
      ASSERT_EQ(manifold.count, 2);
      EXPECT_NEAR(manifold.normal.z(), 1, 1e-5);
      for (int n = 0; n < 2; ++n) {
        EXPECT_NEAR(manifold.point[n].gap, -0.005, 1.1e-3);
        EXPECT_NEAR(std::abs(manifold.point[n].on_a.x() - 0.1), 0.6, 1e-3);
      }
    }
    const auto pair = collide(capsule, capsule, this->at(0.1, 0, -0.49, lying, turn), this->kMargin);
    ASSERT_EQ(pair.count, 2);
    EXPECT_NEAR(this->least_gap(pair), -0.01, 1.1e-3);
  }
  EXPECT_EQ(
      collide(capsule, capsule,
              this->at(0, 0, -0.49, lying, rotation<TypeParam>(std::numbers::pi / 2, 1, 0, 0)), this->kMargin)
          .count,
      1);
}

// The nearest point alone would run from edge to edge as the box rocks.
TYPED_TEST(Collide, AFaceRestsOnAVeryLargeBallByItsCorners) {
  using Scalar = TypeParam;
  const Vector3<Scalar> half(Scalar(0.5), Scalar(0.4), Scalar(0.3));
  const Box<Scalar> box{half};
  const Polyhedron<Scalar> hull = cube_hull(half);
  for (const double radius : {300.0, 1000.0, 5000.0}) {
    const Ball<Scalar> ball{Scalar(radius)};
    // On top of the ball, and tilted by less than the box is level with it.
    for (const double tilt : {0.0, 1e-4}) {
      const Placement<Scalar> placement{Matrix3<Scalar>::Identity(), rotation<Scalar>(tilt, 1, 0, 0),
                                        Vector3<Scalar>(0, 0, Scalar(radius) + half.z())};
      const Scalar rounding = std::numeric_limits<Scalar>::epsilon() * 4 * Scalar(radius);
      for (const auto& manifold :
           {collide(ball, box, placement, this->kMargin), collide(ball, hull, placement, this->kMargin)}) {
        ASSERT_EQ(manifold.count, 4) << radius;
        EXPECT_NEAR(manifold.normal.z(), -1, 1e-5);
        for (const auto& point : manifold.point) {
          EXPECT_NEAR(point.gap, 0.41 / 2 / radius, 1e-4 + rounding);
          EXPECT_NEAR(std::abs(point.on_b.x()), 0.5, 1e-3);
        }
      }
    }
  }
  const auto small =
      collide(Ball<Scalar>{5}, box,
              {Matrix3<Scalar>::Identity(), Matrix3<Scalar>::Identity(), Vector3<Scalar>(0, 0, 5 + half.z())},
              this->kMargin);
  EXPECT_EQ(small.count, 1);
}

TYPED_TEST(Collide, SwappedPairsMirror) {
  const Capsule<TypeParam> capsule{TypeParam(0.2), TypeParam(0.5)};
  const Box<TypeParam> box{Vector3<TypeParam>(0.6, 0.4, 0.3)};
  const auto placement =
      this->at(0.3, 0.1, 0.6, rotation<TypeParam>(1, 1, 2, 3), rotation<TypeParam>(1, 3, 1, 0));
  const auto forward = collide(capsule, box, placement, this->kMargin);
  const auto backward = collide(box, capsule, placement.swapped(), this->kMargin);
  ASSERT_EQ(forward.count, backward.count);
  ASSERT_GT(forward.count, 0);
  EXPECT_NEAR((forward.normal + backward.normal).norm(), 0, this->kEqual);
  EXPECT_NEAR((forward.point[0].on_a - placement.offset - backward.point[0].on_b).norm(), 0, this->kEqual);
}

}  // namespace
}  // namespace tessera::collision
