#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "lpss/collision/collide.h"
#include "lpss/collision/test_shapes.h"

namespace tessera::collision {
namespace {

// A surface of two triangles that share the edge from (0, -1, 0) to (0, 1, 0): one at x < 0 in the plane z =
// 0, one at x > 0 that drops by `drop` at x = 1 (rises, if negative). Both fronts are up.
template <typename Scalar>
struct Fold {
  using Vector = Vector3<Scalar>;

  explicit Fold(double drop, KeptOn kept_on = KeptOn::kSideOfCentre) {
    const Vector low(0, -1, 0);
    const Vector high(0, 1, 0);
    const Vector west(-1, 0, 0);
    const Vector east(1, 0, static_cast<Scalar>(-drop));
    triangle[0] = make_triangle(low, high, west);
    triangle[1] = make_triangle(high, low, east);
    set_neighbour(triangle[0], 0, east);
    set_neighbour(triangle[1], 0, west);
    for (MeshTriangle<Scalar>& side : triangle) side.kept_on = kept_on;
  }

  // Contacts of a shape at a place in the world, with both triangles.
  template <typename Shape>
  Manifold<Scalar> collide(const Shape& shape, int n, double x, double y, double z,
                           const Matrix3<Scalar>& turn = Matrix3<Scalar>::Identity()) const {
    const Vector centre(static_cast<Scalar>(x), static_cast<Scalar>(y), static_cast<Scalar>(z));
    return collision::collide(shape, triangle[n],
                              Placement<Scalar>{turn, Matrix3<Scalar>::Identity(), -centre}, Scalar(0.02));
  }

  MeshTriangle<Scalar> triangle[2];
};

template <typename Scalar>
class MeshTriangleTest : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(MeshTriangleTest, Scalars);

template <typename Scalar>
double least_gap(const Manifold<Scalar>& manifold) {
  double least = std::numeric_limits<double>::max();
  for (int n = 0; n < manifold.count; ++n) least = std::min(least, double(manifold.point[n].gap));
  return least;
}

TYPED_TEST(MeshTriangleTest, ShapesLieOnAFace) {
  const Fold<TypeParam> fold(0);
  const Ball<TypeParam> ball{TypeParam(0.1)};
  const Capsule<TypeParam> capsule{TypeParam(0.1), TypeParam(0.2)};
  const Box<TypeParam> box{Vector3<TypeParam>(TypeParam(0.1), TypeParam(0.1), TypeParam(0.1))};
  const Polyhedron<TypeParam> hull = cube_hull<TypeParam>(box.half);
  const Matrix3<TypeParam> lying = rotation<TypeParam>(std::numbers::pi / 2, 1, 0, 0);
  for (const double gap : {-0.005, 0.005}) {
    const double z = 0.1 + gap;
    const Manifold<TypeParam> all[] = {fold.collide(ball, 0, -0.4, 0, z),
                                       fold.collide(capsule, 0, -0.4, 0, z, lying),
                                       fold.collide(box, 0, -0.4, 0, z), fold.collide(hull, 0, -0.4, 0, z)};
    const int counts[] = {1, 2, 4, 4};
    for (int n = 0; n < 4; ++n) {
      ASSERT_EQ(all[n].count, counts[n]) << n;
      EXPECT_NEAR(all[n].normal.z(), 1, 1e-6);
      for (int k = 0; k < all[n].count; ++k) EXPECT_NEAR(all[n].point[k].gap, gap, 1e-6);
    }
  }
}

// Whatever is over the flat surface, all that touches it is pushed straight up, and only as far as it
// overlaps.
TYPED_TEST(MeshTriangleTest, FlatEdgesDoNotCatch) {
  const Fold<TypeParam> fold(0);
  const Ball<TypeParam> ball{TypeParam(0.1)};
  const Capsule<TypeParam> capsule{TypeParam(0.1), TypeParam(0.2)};
  const Box<TypeParam> box{Vector3<TypeParam>(TypeParam(0.1), TypeParam(0.1), TypeParam(0.1))};
  const Polyhedron<TypeParam> six = prism<TypeParam>(6, 0.12, 0.1);
  const Matrix3<TypeParam> along_y = rotation<TypeParam>(std::numbers::pi / 2, 1, 0, 0);
  const Matrix3<TypeParam> along_x = rotation<TypeParam>(std::numbers::pi / 2, 0, 1, 0);
  for (const double gap : {-0.01, -1e-3, 5e-3}) {
    for (double x = -0.25; x < 0.25; x += 0.0037) {
      for (int n = 0; n < 2; ++n) {
        const Manifold<TypeParam> all[] = {
            fold.collide(ball, n, x, 0.05, 0.1 + gap),
            fold.collide(capsule, n, x, 0.05, 0.1 + gap, along_y),
            fold.collide(capsule, n, x, 0.05, 0.1 + gap, along_x),
            fold.collide(box, n, x, 0.05, 0.1 + gap),
            fold.collide(box, n, x, 0.05, 0.1 + gap, rotation<TypeParam>(0.4, 0, 0, 1)),
            fold.collide(six, n, x, 0.05, 0.1 + gap)};
        int shape = 0;
        for (const Manifold<TypeParam>& manifold : all) {
          SCOPED_TRACE("shape " + std::to_string(shape++) + " at " + std::to_string(x));
          if (manifold.count == 0) continue;
          EXPECT_GT(manifold.normal.z(), 0.9999);
          EXPECT_GE(least_gap(manifold), gap - 1e-5);
        }
        // Nothing is lost: the triangle under the centre carries.
        if ((x < -0.01 && n == 0) || (x > 0.01 && n == 1)) {
          for (const Manifold<TypeParam>& manifold : all) {
            ASSERT_GT(manifold.count, 0);
            EXPECT_NEAR(least_gap(manifold), gap, 1e-5);
          }
        }
      }
    }
  }
}

// The same for shapes that reach through the surface askew, with their centres above it.
TYPED_TEST(MeshTriangleTest, FlatEdgesDoNotPullDown) {
  const Fold<TypeParam> fold(0);
  const Box<TypeParam> box{Vector3<TypeParam>(TypeParam(0.12), TypeParam(0.1), TypeParam(0.06))};
  const Polyhedron<TypeParam> hull = cube_hull<TypeParam>(box.half);
  const Polyhedron<TypeParam> six = prism<TypeParam>(6, 0.12, 0.08);
  const Polyhedron<TypeParam> four = tetrahedron<TypeParam>(0.1);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> within(-1, 1);
  for (int trial = 0; trial < 5000; ++trial) {
    const double x = 0.15 * within(random);
    const double y = 0.2 * within(random);
    const double z = 0.06 + 0.05 * within(random);
    const auto turn = rotation<TypeParam>(4 * within(random), within(random), within(random), within(random));
    for (int n = 0; n < 2; ++n) {
      const Manifold<TypeParam> all[] = {
          fold.collide(box, n, x, y, z, turn), fold.collide(hull, n, x, y, z, turn),
          fold.collide(six, n, x, y, z, turn), fold.collide(four, n, x, y, z, turn)};
      for (int shape = 0; shape < 4; ++shape) {
        if (all[shape].count == 0) continue;
        EXPECT_GT(all[shape].normal.z(), 0.99) << "trial " << trial << ", shape " << shape;
      }
    }
  }
}

TYPED_TEST(MeshTriangleTest, RidgesTouchBetweenTheirNormals) {
  const Fold<TypeParam> fold(1);  // 45 degrees
  const Ball<TypeParam> ball{TypeParam(0.1)};
  const Vector3<TypeParam> slope = fold.triangle[1].normal;
  for (double x = -0.2; x < 0.3; x += 0.0071) {
    int touching = 0;
    for (int n = 0; n < 2; ++n) {
      const Manifold<TypeParam> manifold = fold.collide(ball, n, x, 0, 0.09);
      if (manifold.count == 0) continue;
      ++touching;
      EXPECT_GE(manifold.normal.x(), -1e-3);
      EXPECT_LE(manifold.normal.x(), slope.x() + 1e-3);
    }
    EXPECT_TRUE(touching > 0 || x >= 0.04) << x;
  }
  // A box over the top touches the ridge with a normal of the ridge.
  const Box<TypeParam> box{Vector3<TypeParam>(TypeParam(0.1), TypeParam(0.1), TypeParam(0.1))};
  const Matrix3<TypeParam> tilted = rotation<TypeParam>(std::numbers::pi / 8, 0, 1, 0);
  const double reach = 0.1;
  const Vector3<TypeParam> up = tilted.col(2);
  const Manifold<TypeParam> manifold =
      fold.collide(box, 0, double(up.x()) * (reach - 0.002), 0, double(up.z()) * (reach - 0.002), tilted);
  ASSERT_GT(manifold.count, 0);
  EXPECT_NEAR(least_gap(manifold), -0.002, 2e-4);
  EXPECT_NEAR(manifold.normal.dot(up), 1, 1e-3);
}

TYPED_TEST(MeshTriangleTest, ValleysTouchAlongTheirFaces) {
  const Fold<TypeParam> fold(-1);
  const Ball<TypeParam> ball{TypeParam(0.1)};
  const Box<TypeParam> box{Vector3<TypeParam>(TypeParam(0.1), TypeParam(0.1), TypeParam(0.1))};
  for (double x = -0.3; x < 0.1; x += 0.0063) {
    for (int n = 0; n < 2; ++n) {
      for (const Manifold<TypeParam>& manifold :
           {fold.collide(ball, n, x, 0, 0.098), fold.collide(box, n, x - 0.06, 0, 0.098)}) {
        if (manifold.count == 0) continue;
        // Along the normal of one of the faces, or of the box where its edge meets the slope.
        const double along = double(manifold.normal.dot(fold.triangle[n].normal));
        EXPECT_GT(along, 0.999) << x << " " << n;
      }
    }
  }
}

TYPED_TEST(MeshTriangleTest, SidesOfTriangles) {
  const Ball<TypeParam> ball{TypeParam(0.1)};
  const Box<TypeParam> box{Vector3<TypeParam>(TypeParam(0.1), TypeParam(0.1), TypeParam(0.1))};
  const Capsule<TypeParam> capsule{TypeParam(0.1), TypeParam(0.2)};
  const Fold<TypeParam> open(0);
  const Fold<TypeParam> solid(0, KeptOn::kFront);
  for (const double z : {0.05, -0.05}) {
    const Manifold<TypeParam> from_open[] = {open.collide(ball, 0, -0.4, 0, z),
                                             open.collide(box, 0, -0.4, 0, z),
                                             open.collide(capsule, 0, -0.4, 0, z)};
    const Manifold<TypeParam> from_solid[] = {solid.collide(ball, 0, -0.4, 0, z),
                                              solid.collide(box, 0, -0.4, 0, z),
                                              solid.collide(capsule, 0, -0.4, 0, z)};
    for (int n = 0; n < 3; ++n) {
      ASSERT_GT(from_open[n].count, 0);
      EXPECT_NEAR(from_open[n].normal.z(), z > 0 ? 1 : -1, 1e-6);
      ASSERT_GT(from_solid[n].count, 0);
      EXPECT_NEAR(from_solid[n].normal.z(), 1, 1e-6);
      EXPECT_LT(from_solid[n].point[0].gap, -0.04);
    }
  }
}

// Lone triangles against sampled support functions, from both sides.
TYPED_TEST(MeshTriangleTest, LoneTrianglesAgainstSamples) {
  using Scalar = TypeParam;
  const MeshTriangle<Scalar> triangle =
      make_triangle<Scalar>({Scalar(-0.7), Scalar(-0.5), 0}, {Scalar(0.8), Scalar(-0.3), Scalar(0.1)},
                            {0, Scalar(0.9), Scalar(-0.1)});
  const Box<Scalar> box{Vector3<Scalar>(Scalar(0.5), Scalar(0.3), Scalar(0.2))};
  const Polyhedron<Scalar> four = tetrahedron<Scalar>(0.4);
  const Capsule<Scalar> capsule{Scalar(0.15), Scalar(0.4)};
  const Ball<Scalar> ball{Scalar(0.3)};
  std::mt19937 random(11);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int n = 0; n < 200; ++n) {
    SCOPED_TRACE(n);
    const Vector3<Scalar> offset =
        Eigen::Vector3d(number(-1, 1), number(-1, 1), number(-1, 1)).cast<Scalar>();
    const Placement<Scalar> placement{rotation<Scalar>(number(0, 3), number(-1, 1), number(-1, 1), 1),
                                      rotation<Scalar>(number(0, 3), number(-1, 1), number(-1, 1), 1),
                                      offset};
    const Scalar margin(0.05);
    const auto compare = [&](const auto& shape) {
      const Manifold<Scalar> manifold = collide(shape, triangle, placement, margin);
      const Cloud a = cloud(shape).placed(placement.a.template cast<double>(), Eigen::Vector3d::Zero());
      const Cloud b = cloud(triangle).placed(placement.b.template cast<double>(),
                                             placement.offset.template cast<double>());
      const double exact = separation_max(a, b);
      EXPECT_TRUE(manifold.count == 0 || exact < 0.0505) << exact;
      if (exact > 0.0495) return;
      ASSERT_GT(manifold.count, 0) << exact;
      const double found = separation(a, b, manifold.normal.template cast<double>());
      if (exact > 0) {
        EXPECT_GE(least_gap(manifold), exact - 1e-4);
        EXPECT_LE(least_gap(manifold), exact + 0.04);
      } else {
        // The side of the centre is kept, which may be the longer way.
        EXPECT_LE(found, 1e-4);
        EXPECT_GE(least_gap(manifold), found - 1e-3);
      }
    };
    compare(box);
    compare(four);
    compare(capsule);
    compare(ball);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace tessera::collision
