#include "lpss/solver/contact_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace tessera {
namespace {

constexpr double kTick = 1.0 / 60;
constexpr double kGravity = 9.81;

// Unit cubes of 1 kg, axis-parallel, over a floor; contacts are at the corners of the lower faces.
template <typename Scalar>
class Cubes {
 public:
  using Solver = ContactSolver<Scalar>;
  using Vector = typename Solver::Vector;

  Cubes() { bodies_.emplace_back(); }  // the floor

  std::size_t add(const Vector& centre, const Vector& velocity = Vector::Zero()) {
    typename Solver::Body body;
    body.linear = velocity;
    body.inverse_mass = 1;
    body.inverse_inertia = Solver::Matrix::Identity() * 6;
    bodies_.push_back(body);
    centres_.resize(bodies_.size());
    centres_.back() = centre;
    return bodies_.size() - 1;
  }

  // The lower face of `a` on `b`, or on the floor (0).
  typename Solver::Patch& touch(std::size_t a, std::size_t b, Scalar friction = Scalar(0.5)) {
    typename Solver::Patch patch;
    patch.a = a;
    patch.b = b;
    patch.friction = friction;
    patch.points = 4;
    const Scalar floor = b == 0 ? 0 : centres_[b].z() + Scalar(0.5);
    for (std::size_t n = 0; n < 4; ++n) {
      auto& point = patch.point[n];
      point.lever_a =
          Vector(n % 2 ? Scalar(0.5) : Scalar(-0.5), n / 2 ? Scalar(0.5) : Scalar(-0.5), Scalar(-0.5));
      point.lever_b = centres_[a] + point.lever_a - centres_[b];
      point.normal = Vector(0, 0, 1);
      point.gap = centres_[a].z() - Scalar(0.5) - floor;
    }
    return patches_.emplace_back(patch);
  }

  // A tick of so many steps; forces are gravity.
  void step(int steps = 4, Scalar bounce_from = Scalar(0.2)) {
    for (std::size_t n = 1; n < bodies_.size(); ++n)
      bodies_[n].linear_force = Vector(0, 0, Scalar(-kGravity * kTick));
    typename Solver::Options options;
    options.time_step = Scalar(kTick);
    options.steps = steps;
    options.bounce_from = bounce_from;
    solver_.begin(options, bodies_, patches_);
    for (int n = 0; n < steps; ++n) {
      solver_.start_step();
      solver_.pass(true);
      solver_.advance();
      solver_.pass(false);
      solver_.end_step();
    }
    solver_.rebound();
    solver_.end(patches_);
    for (std::size_t n = 1; n < bodies_.size(); ++n) {
      bodies_[n].linear += solver_[n].linear;
      bodies_[n].angular += solver_[n].angular;
      centres_[n] += solver_[n].way + bodies_[n].linear * Scalar(kTick);
    }
    for (auto& patch : patches_) {
      const Scalar floor = patch.b == 0 ? 0 : centres_[patch.b].z() + Scalar(0.5);
      for (std::size_t n = 0; n < patch.points; ++n)
        patch.point[n].gap = centres_[patch.a].z() - Scalar(0.5) - floor;
    }
  }

  typename Solver::Body& body(std::size_t n) { return bodies_[n]; }
  Vector& centre(std::size_t n) { return centres_[n]; }
  std::vector<typename Solver::Patch>& patches() { return patches_; }

 private:
  Solver solver_;
  std::vector<typename Solver::Body> bodies_;
  std::vector<Vector> centres_ = {Vector::Zero()};
  std::vector<typename Solver::Patch> patches_;
};

template <typename Scalar>
class ContactSolverTest : public ::testing::Test {
 public:
  using Vector = typename ContactSolver<Scalar>::Vector;
};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(ContactSolverTest, Scalars);

TYPED_TEST(ContactSolverTest, ACubeRestsAndTheFloorCarriesItsWeight) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)});
  cubes.touch(cube, 0);
  for (int tick = 0; tick < 120; ++tick) cubes.step();
  EXPECT_NEAR(cubes.centre(cube).z(), 0.5, 1e-3);
  EXPECT_NEAR(cubes.body(cube).linear.norm(), 0, 1e-5);
  TypeParam sum = 0;
  for (const auto& point : cubes.patches()[0].point) sum += point.impulse;
  EXPECT_NEAR(sum, kGravity * kTick, 1e-4);
}

TYPED_TEST(ContactSolverTest, ATowerOfTenStands) {
  Cubes<TypeParam> cubes;
  for (int level = 0; level < 10; ++level) {
    const std::size_t cube = cubes.add({TypeParam(0.02) * TypeParam(level % 3), 0, TypeParam(0.5 + level)});
    cubes.touch(cube, cube - 1);
  }
  for (int tick = 0; tick < 600; ++tick) cubes.step();
  EXPECT_NEAR(cubes.centre(10).z(), 9.5, 0.03);
  EXPECT_LT(cubes.body(10).linear.norm(), 0.01);
}

TYPED_TEST(ContactSolverTest, FrictionStopsASlidingCubeAsCoulombSays) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)}, {TypeParam(1.2), TypeParam(-1.6), 0});
  cubes.touch(cube, 0, TypeParam(0.4));
  double way = 0;
  // Held flat: what friction does along the floor.
  for (int tick = 0; tick < 120; ++tick) {
    cubes.body(cube).inverse_inertia.setZero();
    cubes.step();
  }
  way = cubes.centre(cube).template head<2>().norm();
  EXPECT_NEAR(way, 2 * 2 / (2 * 0.4 * kGravity), 0.03);
  EXPECT_NEAR(cubes.centre(cube).y() / cubes.centre(cube).x(), -1.6 / 1.2, 1e-3) << "it slides straight";
  EXPECT_LT(cubes.body(cube).linear.norm(), 1e-4);
}

TYPED_TEST(ContactSolverTest, TwistIsLimitedByFrictionTimesTheMeanArm) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)});
  cubes.touch(cube, 0, TypeParam(0.3));
  for (int tick = 0; tick < 30; ++tick) cubes.step();
  cubes.body(cube).angular = {0, 0, 10};
  cubes.step();
  const double arm = std::sqrt(0.5);
  EXPECT_NEAR(cubes.body(cube).angular.z(), 10 - 6 * 0.3 * arm * kGravity * kTick, 0.01);
  for (int tick = 0; tick < 120; ++tick) cubes.step();
  EXPECT_NEAR(cubes.body(cube).angular.z(), 0, 1e-5);
}

TYPED_TEST(ContactSolverTest, ABounceReturnsTheShareOfTheApproach) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)}, {0, 0, -3});
  cubes.body(cube).inverse_inertia.setZero();
  cubes.touch(cube, 0).restitution = TypeParam(0.5);
  cubes.step();
  EXPECT_NEAR(cubes.body(cube).linear.z(), 1.5, 1e-4);
}

TYPED_TEST(ContactSolverTest, AGapMayCloseButNotMore) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.6)}, {0, 0, -60});
  cubes.body(cube).inverse_inertia.setZero();
  cubes.touch(cube, 0);
  cubes.step();
  EXPECT_NEAR(cubes.centre(cube).z(), 0.5, 1e-4);
}

// An overlap opens without giving the cube a velocity.
TYPED_TEST(ContactSolverTest, AnOverlapOpensByPositionAlone) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.4)});
  cubes.body(cube).inverse_inertia.setZero();
  cubes.touch(cube, 0);
  for (int tick = 0; tick < 60; ++tick) {
    cubes.step();
    EXPECT_LT(cubes.body(cube).linear.z(), 1e-5);
  }
  EXPECT_NEAR(cubes.centre(cube).z(), 0.5, 0.005);
}

// Patches that share no body may be solved in any order.
TYPED_TEST(ContactSolverTest, PatchesThatShareNoBodyCommute) {
  std::vector<typename Cubes<TypeParam>::Vector> ends[2];
  for (const bool reversed : {false, true}) {
    Cubes<TypeParam> cubes;
    for (int n = 0; n < 5; ++n) {
      const auto x = TypeParam(2 * n);
      cubes.add({x, 0, TypeParam(0.5 - 0.01 * n)}, {TypeParam(0.3) * TypeParam(n), 0, TypeParam(-1)});
    }
    for (std::size_t n = 1; n <= 5; ++n) cubes.touch(reversed ? 6 - n : n, 0);
    for (int tick = 0; tick < 20; ++tick) cubes.step();
    for (std::size_t n = 1; n <= 5; ++n) ends[reversed].push_back(cubes.centre(n));
  }
  EXPECT_EQ(ends[0], ends[1]);
}

// A server that solves an island of others does not know where static bodies are.
TYPED_TEST(ContactSolverTest, LeversOfWhatCannotMoveChangeNoBit) {
  typename Cubes<TypeParam>::Vector ends[2];
  for (const bool moved : {false, true}) {
    Cubes<TypeParam> cubes;
    const std::size_t cube = cubes.add({0, 0, TypeParam(0.49)}, {1, TypeParam(0.3), -1});
    cubes.body(cube).angular = {0, TypeParam(0.2), 3};
    for (auto& point : cubes.touch(cube, 0).point)
      if (moved)
        point.lever_b += typename Cubes<TypeParam>::Vector(TypeParam(12.3), TypeParam(-45.6), TypeParam(0.7));
    for (int tick = 0; tick < 20; ++tick) cubes.step();
    ends[moved] = cubes.body(cube).angular;
  }
  EXPECT_EQ(ends[0], ends[1]);
}

TYPED_TEST(ContactSolverTest, MomentumStays) {
  Cubes<TypeParam> cubes;
  const std::size_t lower = cubes.add({0, 0, 10}, {0, 0, 2});
  const std::size_t upper = cubes.add({TypeParam(0.2), 0, 11}, {0, 1, -4});
  cubes.touch(upper, lower);
  cubes.step();
  const auto sum = cubes.body(lower).linear + cubes.body(upper).linear;
  const double small = 8 * std::numeric_limits<TypeParam>::epsilon();
  EXPECT_NEAR(sum.x(), 0, small);
  EXPECT_NEAR(sum.y(), 1, small);
  EXPECT_NEAR(sum.z(), -2 - 2 * kGravity * kTick, 4 * small);
}

}  // namespace
}  // namespace tessera
