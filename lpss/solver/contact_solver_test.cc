#include "lpss/solver/contact_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <random>
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
    options.bounce_from_min = bounce_from;
    options.lanes = lanes_;
    solver_.begin(options, bodies_, patches_);
    for (int n = 0; n < steps; ++n) {
      solver_.start_step();
      solver_.pass(true);
      solver_.advance();
      solver_.pass(false);
      solver_.end_step();
    }
    for (int n = 0; n < kRebounds; ++n) solver_.rebound();
    solver_.end(patches_);
    for (std::size_t n = 1; n < bodies_.size(); ++n) {
      bodies_[n].linear += solver_.change(n).linear;
      bodies_[n].angular += solver_.change(n).angular;
      centres_[n] += solver_.correction(n).linear + bodies_[n].linear * Scalar(kTick);
    }
    for (auto& patch : patches_) {
      const Scalar floor = patch.b == 0 ? 0 : centres_[patch.b].z() + Scalar(0.5);
      for (std::size_t n = 0; n < patch.points; ++n)
        patch.point[n].gap = centres_[patch.a].z() - Scalar(0.5) - floor;
    }
  }

  void set_lanes(int lanes) { lanes_ = lanes; }
  typename Solver::Body& body(std::size_t n) { return bodies_[n]; }
  Vector& centre(std::size_t n) { return centres_[n]; }
  std::vector<typename Solver::Patch>& patches() { return patches_; }

 private:
  Solver solver_;
  int lanes_ = 0;
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

// On a floor that is accelerated evenly, friction bears the same in each step: once it does, no step corrects
// anything.
TYPED_TEST(ContactSolverTest, ACubeKeepsUpWithAFloorThatHasACourse) {
  constexpr TypeParam kGain = TypeParam(2 * kTick);  // m/s a tick
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)});
  auto& patch = cubes.touch(cube, 0);
  for (int tick = 0; tick < 30; ++tick) cubes.step();
  typename ContactSolver<TypeParam>::Course course;
  course.linear_change = {-kGain, 0, 0};
  patch.course = &course;
  TypeParam place = 0;
  for (int tick = 0; tick < 60; ++tick) {
    course.linear = {-kGain * TypeParam(tick), 0, 0};
    cubes.step();
    place += kGain * TypeParam(tick + 1) * TypeParam(kTick);
    EXPECT_NEAR(cubes.body(cube).linear.x(), kGain * TypeParam(tick + 1), 2e-3) << tick;
  }
  EXPECT_NEAR(cubes.body(cube).linear.x(), kGain * 60, 2e-4);
  EXPECT_NEAR(cubes.patches()[0].friction_impulse.x(), kGain, 1e-5) << "1 kg";
  EXPECT_NEAR(cubes.centre(cube).x(), place, 2e-4);
}

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

// Friction is as large as when it slides or turns alone, and shared between both. A cube whose moment of
// inertia is that of a ring through its corners keeps the ratio of its speeds.
TYPED_TEST(ContactSolverTest, SlidingAndTwistingShareOneFriction) {
  const double arm = std::sqrt(0.5);
  for (const int lanes : ContactSolver<TypeParam>::widths()) {
    Cubes<TypeParam> cubes;
    cubes.set_lanes(lanes);
    const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)});
    cubes.body(cube).inverse_inertia.setZero();
    cubes.body(cube).inverse_inertia(2, 2) = 2;
    cubes.touch(cube, 0, TypeParam(0.3));
    for (int tick = 0; tick < 30; ++tick) cubes.step();
    cubes.body(cube).linear = {TypeParam(1.2), TypeParam(-1.6), 0};
    cubes.body(cube).angular = {0, 0, TypeParam(1.5 / arm)};
    for (int tick = 1; tick <= 40; ++tick) {
      cubes.step();
      const double left = 2.5 - 0.3 * kGravity * kTick * tick;
      EXPECT_NEAR(cubes.body(cube).linear.norm(), left * 0.8, 1e-3) << tick;
      EXPECT_NEAR(cubes.body(cube).angular.z() * arm, left * 0.6, 1e-3) << tick;
    }
    for (int tick = 0; tick < 60; ++tick) cubes.step();
    EXPECT_NEAR(cubes.body(cube).linear.norm(), 0, 1e-6);
    EXPECT_NEAR(cubes.body(cube).angular.z(), 0, 1e-6);
  }
}

TYPED_TEST(ContactSolverTest, ABounceReturnsTheShareOfTheApproach) {
  Cubes<TypeParam> cubes;
  const std::size_t cube = cubes.add({0, 0, TypeParam(0.5)}, {0, 0, -3});
  cubes.body(cube).inverse_inertia.setZero();
  cubes.touch(cube, 0).restitution = TypeParam(0.5);
  cubes.step();
  EXPECT_NEAR(cubes.body(cube).linear.z(), 1.5, 1e-4);
}

// What falls on its way to the floor parts with the speed at which it meets it, from where it met it.
TYPED_TEST(ContactSolverTest, ABounceKeepsTheEnergyOfTheFallInTheTick) {
  for (const double gap : {0.0, 0.01, 0.03}) {
    Cubes<TypeParam> cubes;
    const std::size_t cube = cubes.add({0, 0, TypeParam(0.5 + gap)}, {0, 0, -3});
    cubes.body(cube).inverse_inertia.setZero();
    cubes.touch(cube, 0).restitution = TypeParam(1);
    cubes.step();
    EXPECT_NEAR(cubes.centre(cube).z(), 0.5, 1e-6) << gap;
    EXPECT_NEAR(cubes.body(cube).linear.z(), std::sqrt(9 + 2 * kGravity * gap), 1e-5) << gap;
  }
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

// Whether others that are solved in the same task have surfaces depends on who hosts them.
TYPED_TEST(ContactSolverTest, SurfacesOfOthersChangeNoBitOfACubeThatHardlyTurns) {
  using V = typename Cubes<TypeParam>::Vector;
  const TypeParam spin = std::sqrt(std::numeric_limits<TypeParam>::denorm_min()) / 1024;  // its square is 0
  for (const int lanes : ContactSolver<TypeParam>::widths()) {
    V ends[2];
    for (const bool has_surface : {false, true}) {
      Cubes<TypeParam> cubes;
      cubes.set_lanes(lanes);
      for (const std::size_t n : {1, 2}) {
        cubes.add(V(TypeParam(4 * n), 0, 2));
        cubes.touch(n, 0);
      }
      cubes.body(1).angular = V(spin, 0, 0);
      typename ContactSolver<TypeParam>::Surface surface;
      if (has_surface) cubes.patches()[1].surface = &surface;
      cubes.step();
      ends[has_surface] = cubes.body(1).angular;
    }
    EXPECT_EQ(ends[0], ends[1]) << lanes << " lanes";
  }
}

// Its impulse to roll would be beyond the range of numbers.
TYPED_TEST(ContactSolverTest, NorOfOneThatTurnsAsFastAsNumbersAllow) {
  using V = typename Cubes<TypeParam>::Vector;
  for (const int lanes : ContactSolver<TypeParam>::widths()) {
    V ends[2];
    for (const bool has_surface : {false, true}) {
      Cubes<TypeParam> cubes;
      cubes.set_lanes(lanes);
      for (const std::size_t n : {1, 2}) {
        cubes.add(V(TypeParam(4 * n), 0, 2));
        cubes.body(n).inverse_inertia /= 100;
        cubes.touch(n, 0);
      }
      cubes.body(1).angular = V(std::numeric_limits<TypeParam>::max() / 8, 0, 0);
      typename ContactSolver<TypeParam>::Surface surface;
      if (has_surface) cubes.patches()[1].surface = &surface;
      cubes.step();
      ends[has_surface] = cubes.body(1).angular;
    }
    EXPECT_EQ(ends[0], ends[1]) << lanes << " lanes";
  }
}

// The inverse of such a friction is infinite.
TYPED_TEST(ContactSolverTest, SurfacesOfOthersChangeNoBitOfACubeWithTheLeastFriction) {
  using V = typename Cubes<TypeParam>::Vector;
  for (const int lanes : ContactSolver<TypeParam>::widths()) {
    V ends[2];
    for (const bool has_surface : {false, true}) {
      Cubes<TypeParam> cubes;
      cubes.set_lanes(lanes);
      for (const std::size_t n : {1, 2}) {
        cubes.add(V(TypeParam(4 * n), 0, TypeParam(0.5)));
        cubes.touch(n, 0, std::numeric_limits<TypeParam>::denorm_min());
      }
      cubes.body(1).angular = V(0, 0, 1);
      typename ContactSolver<TypeParam>::Surface surface;
      surface.torsion = TypeParam(0.1);
      if (has_surface) cubes.patches()[1].surface = &surface;
      cubes.step();
      ends[has_surface] = cubes.body(1).angular;
      EXPECT_TRUE(cubes.body(1).angular.allFinite() && cubes.body(2).angular.allFinite())
          << lanes << " lanes";
    }
    EXPECT_EQ(ends[0], ends[1]) << lanes << " lanes";
  }
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

// Bodies that move, are moved, or neither, with patches of all sorts between them. Some patches share both
// bodies; kinematic and static bodies have many.
template <typename Scalar>
class RandomScene {
 public:
  using Solver = ContactSolver<Scalar>;
  using Vector = typename Solver::Vector;

  explicit RandomScene(unsigned seed) : random_(seed), has_surfaces_(seed % 2 == 1) {
    const auto count = static_cast<std::size_t>(number(3, 80));
    for (std::size_t n = 0; n < count; ++n) bodies_.push_back(body());
    const auto patches = static_cast<std::size_t>(number(0, Scalar(4 * count)));
    for (std::size_t n = 0; n < patches; ++n) patches_.push_back(patch());
  }

  // A chain of so many bodies, of which each touches the next three times: every other pair, then the rest,
  // and so on.
  RandomScene(unsigned seed, std::size_t count) : random_(seed), has_surfaces_(seed % 2 == 1) {
    for (std::size_t n = 0; n < count; ++n) bodies_.push_back(body());
    for (std::size_t round = 0; round < 6; ++round) {
      for (std::size_t a = round % 2; a + 1 < count; a += 2) {
        if (bodies_[a].inverse_mass > 0 || bodies_[a + 1].inverse_mass > 0)
          patches_.push_back(patch_of(a, a + 1));
      }
    }
  }

  // What a tick computes: the state of all bodies and the impulses. What acts between passes pushes bodies,
  // too.
  std::vector<Scalar> step(int lanes, const ParallelFor* parallel = nullptr) {
    typename Solver::Options options;
    options.time_step = Scalar(kTick);
    options.steps = 3;
    options.bounce_from_min = Scalar(0.3);
    options.lanes = lanes;
    options.parallel = parallel;
    std::vector<Scalar> all;
    const auto keep = [&](const auto& v) { all.insert(all.end(), v.data(), v.data() + v.size()); };
    solver_.begin(options, bodies_, patches_);
    const auto couple = [&] {
      for (std::size_t n = 0; n < bodies_.size(); n += 3) {
        if (bodies_[n].inverse_mass == 0) continue;
        auto change = solver_.change(n);
        if (n % 2) {
          change.linear *= Scalar(0.99);
          change.angular -= Vector(0, Scalar(0.01), 0);
        } else if (n % 4) {
          change.linear.y() = Scalar(-0.0);
        }
        solver_.set_change(n, change);
      }
    };
    for (int n = 0; n < options.steps; ++n) {
      solver_.start_step();
      couple();
      for (int pass = 0; pass < 2; ++pass) {
        solver_.pass(true);
        couple();
      }
      solver_.advance();
      solver_.pass(false);
      couple();
      solver_.end_step();
    }
    for (int n = 0; n < kRebounds; ++n) solver_.rebound();
    solver_.end(patches_);
    for (std::size_t n = 0; n < bodies_.size(); ++n) {
      keep(solver_.change(n).linear);
      keep(solver_.change(n).angular);
      keep(solver_.correction(n).linear);
      keep(solver_.correction(n).angular);
      bodies_[n].linear += solver_.change(n).linear;
      bodies_[n].angular += solver_.change(n).angular;
    }
    for (const auto& patch : patches_) {
      for (std::size_t n = 0; n < patch.points; ++n) all.push_back(patch.point[n].impulse);
      keep(patch.friction_impulse);
      all.push_back(patch.twist_impulse);
      if (patch.surface) keep(patch.surface->rolling_impulse);
    }
    return all;
  }

 private:
  Scalar number(Scalar from, Scalar to) {
    return from + (to - from) * (static_cast<Scalar>(random_()) / Scalar(4294967295.0));
  }
  Vector vector(Scalar size) { return {number(-size, size), number(-size, size), number(-size, size)}; }

  typename Solver::Body body() {
    typename Solver::Body body;
    const Scalar sort = number(0, 1);
    if (sort < Scalar(0.1)) return body;
    body.linear = vector(2);
    body.angular = vector(3);
    if (sort < Scalar(0.2)) return body;
    body.linear_force = Vector(0, 0, Scalar(-kGravity * kTick));
    body.angular_force = vector(Scalar(0.1));
    body.inverse_mass = number(Scalar(0.1), 3);
    const Eigen::AngleAxis<Scalar> turn(number(0, 3), vector(1).normalized());
    const Vector inertia(number(1, 9), number(1, 900), number(1, 30));
    body.inverse_inertia = turn * inertia.asDiagonal() * turn.inverse();
    return body;
  }

  typename Solver::Patch patch() {
    const auto place = [&] { return random_() % bodies_.size(); };
    std::size_t a = 0;
    std::size_t b = 0;
    do {
      a = place();
      b = place();
    } while (a == b || (bodies_[a].inverse_mass == 0 && bodies_[b].inverse_mass == 0));
    return patch_of(a, b);
  }

  typename Solver::Patch patch_of(std::size_t a, std::size_t b) {
    typename Solver::Patch patch;
    patch.a = a;
    patch.b = b;
    patch.friction = number(0, 1);
    patch.restitution = std::max(Scalar(0), number(-1, 1));
    patch.is_jointed = number(0, 1) < Scalar(0.2);
    patch.points = 1 + random_() % kPatchPointsMax;
    const Vector normal = vector(1).normalized();
    for (std::size_t n = 0; n < patch.points; ++n) {
      auto& point = patch.point[n];
      point.lever_a = vector(Scalar(0.5));
      point.lever_b = vector(Scalar(0.5));
      point.normal = (normal + vector(Scalar(0.1))).normalized();
      point.gap = number(Scalar(-0.01), Scalar(0.01));
      point.impulse = number(0, Scalar(0.1));
    }
    patch.friction_impulse = vector(Scalar(0.05));
    patch.twist_impulse = number(Scalar(-0.01), Scalar(0.01));
    if (has_surfaces_ && number(0, 1) < Scalar(0.3)) patch.surface = &surfaces_.emplace_back(surface());
    return patch;
  }

  // Each of its traits in some.
  typename Solver::Surface surface() {
    const auto sometimes = [&](Scalar value) { return number(0, 1) < Scalar(0.5) ? value : Scalar(0); };
    typename Solver::Surface surface;
    if (number(0, 1) < Scalar(0.5)) {
      surface.direction = vector(1).normalized();
      surface.across = sometimes(number(0, 1));
    }
    surface.drift = vector(1) * sometimes(1);
    surface.torsion = sometimes(number(0, Scalar(0.1)));
    surface.rolling = sometimes(number(0, Scalar(0.1)));
    surface.rolling_impulse = vector(Scalar(0.01)) * sometimes(1);
    return surface;
  }

  std::mt19937 random_;
  Solver solver_;
  bool has_surfaces_;
  std::deque<typename Solver::Surface> surfaces_;
  std::vector<typename Solver::Body> bodies_;
  std::vector<typename Solver::Patch> patches_;
};

template <typename Scalar>
::testing::AssertionResult same_bits(const std::vector<Scalar>& a, const std::vector<Scalar>& b) {
  if (a.size() != b.size()) return ::testing::AssertionFailure() << a.size() << " and " << b.size();
  for (std::size_t n = 0; n < a.size(); ++n) {
    if (a[n] != b[n] || std::signbit(a[n]) != std::signbit(b[n]))
      return ::testing::AssertionFailure() << n << " of " << a.size() << ": " << a[n] << " and " << b[n];
  }
  return ::testing::AssertionSuccess();
}

TYPED_TEST(ContactSolverTest, LanesChangeNoBitOfRandomScenes) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::vector<TypeParam> expected[3];
    for (const int lanes : {1, 0, 4, 2, 8}) {
      const auto widths = ContactSolver<TypeParam>::widths();
      if (lanes != 0 && std::find(widths.begin(), widths.end(), lanes) == widths.end()) continue;
      RandomScene<TypeParam> scene(seed);
      for (std::vector<TypeParam>& tick : expected) {
        const std::vector<TypeParam> found = scene.step(lanes);
        if (lanes == 1) {
          tick = found;
          for (const TypeParam value : found) ASSERT_TRUE(std::isfinite(value));
        }
        ASSERT_TRUE(same_bits(found, tick)) << "lanes " << lanes << ", seed " << seed;
      }
    }
  }
}

TYPED_TEST(ContactSolverTest, PiecesOnThreadsChangeNoBitOfALargeScene) {
  std::size_t most = 0;
  const ParallelFor backwards = [&](std::size_t count, absl::FunctionRef<void(std::size_t)> body) {
    most = std::max(most, count);
    for (std::size_t piece = count; piece-- > 0;) body(piece);
  };
  RandomScene<TypeParam> here(1, 4000);
  RandomScene<TypeParam> on_threads(1, 4000);
  for (int tick = 0; tick < 3; ++tick)
    ASSERT_TRUE(same_bits(on_threads.step(0, &backwards), here.step(0))) << tick;
  EXPECT_GT(most, 3u) << "there are stages of several pieces";
}

TYPED_TEST(ContactSolverTest, LanesChangeNoBitOfTowers) {
  std::vector<std::vector<TypeParam>> ends;
  for (const int lanes : ContactSolver<TypeParam>::widths()) {
    Cubes<TypeParam> cubes;
    cubes.set_lanes(lanes);
    for (int tower = 0; tower < 13; ++tower) {
      for (int level = 0; level < 6; ++level) {
        const std::size_t cube = cubes.add(
            {TypeParam(3 * tower) + TypeParam(0.03) * TypeParam(level % 3), 0, TypeParam(0.499 + level)});
        cubes.touch(cube, level == 0 ? 0 : cube - 1);
      }
    }
    for (int tick = 0; tick < 60; ++tick) cubes.step();
    std::vector<TypeParam>& end = ends.emplace_back();
    for (std::size_t n = 1; n <= 13 * 6; ++n) {
      end.insert(end.end(), cubes.centre(n).data(), cubes.centre(n).data() + 3);
      end.insert(end.end(), cubes.body(n).angular.data(), cubes.body(n).angular.data() + 3);
    }
    EXPECT_TRUE(same_bits(end, ends[0])) << lanes;
  }
}

// The inverse inertia of a thin rod, in f32 too, leaves what rows and forces do to each axis.
TYPED_TEST(ContactSolverTest, ChangesSurviveTheAxesOfAThinRod) {
  using Axis = typename TestFixture::Vector;
  typename ContactSolver<TypeParam>::Body rod;
  const Eigen::AngleAxis<TypeParam> turn(TypeParam(0.7), Axis(1, 2, 3).normalized());
  rod.inverse_mass = 1;
  rod.inverse_inertia = turn * Axis(12, 12, 2e4).asDiagonal() * turn.inverse();
  rod.angular_force = Axis(TypeParam(0.1), TypeParam(-0.2), TypeParam(0.3));
  ContactSolver<TypeParam> solver;
  const std::vector<typename ContactSolver<TypeParam>::Body> bodies = {rod};
  solver.begin({.time_step = TypeParam(kTick), .steps = 1}, bodies, {});
  solver.start_step();
  const TypeParam small = 20 * std::numeric_limits<TypeParam>::epsilon();
  EXPECT_LT((solver.change(0).angular - rod.angular_force).norm(), small);
  solver.set_change(0, {Axis(1, 2, 3), Axis(3, 2, 1)});
  EXPECT_EQ(solver.change(0).linear, Axis(1, 2, 3));
  EXPECT_LT((solver.change(0).angular - Axis(3, 2, 1)).norm(), 10 * small);
  const Axis angular = solver.change(0).angular;
  solver.set_change(0, solver.change(0));
  EXPECT_EQ(solver.change(0).angular, angular);
}

}  // namespace
}  // namespace tessera
