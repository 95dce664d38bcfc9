// Islands made of numbers alone, with no world around them.
#include "lpss/islands/step_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <random>

#include "lpss/islands/island_steps.h"

namespace tessera {
namespace {

constexpr double kTick = 1.0 / 60;  // s
constexpr double kGravity = 9.81;   // N/kg
const ParallelFor kAlone;

template <typename Scalar>
class Arrays : public ::testing::Test {
 protected:
  using Vector = typename Islands<Scalar>::Vector;

  Arrays() { solver_ = std::make_unique<StepSolver<Scalar>>(StepOptions{}); }

  // A body of so many kg, with a moment of inertia of as much about each axis; all are added before contacts.
  std::size_t add_body(double mass, const Vector& velocity, bool is_heavy = true) {
    auto& body = islands_.bodies.emplace_back();
    body.linear = velocity;
    body.linear_force = Vector(0, 0, Scalar(is_heavy ? -kGravity * kTick : 0));
    body.inverse_mass = Scalar(1 / mass);
    body.inverse_inertia.setIdentity();
    body.inverse_inertia /= Scalar(mass);
    auto& frame = islands_.frames.emplace_back();
    frame.rotation.setIdentity();
    frame.position.setZero();
    frame.moments = Vector::Constant(Scalar(mass));
    frame.inverse_moments = Vector::Constant(Scalar(1 / mass));
    islands_.solved.emplace_back();
    return islands_.dynamics++;
  }
  std::size_t ground() {
    if (islands_.bodies.size() == islands_.dynamics) islands_.bodies.emplace_back();
    return islands_.fixed();
  }

  // One point; a is above b.
  void add_contact(std::size_t a, std::size_t b, double restitution = 0) {
    islands_.contacts.push_back({islands_.patches.size(), 1, restitution > 0});
    auto& patch = islands_.patches.emplace_back();
    patch.a = a;
    patch.b = b;
    patch.restitution = Scalar(restitution);
    patch.points = 1;
    patch.point[0] = {.lever_a = Vector(0, 0, Scalar(-0.5)),
                      .lever_b = Vector(0, 0, Scalar(0.5)),
                      .normal = Vector::UnitZ()};
  }

  void solve() {
    ground();
    solver_->solve(islands_, kTick, 4, kAlone);
  }
  double change(std::size_t body) const { return double(islands_.solved[body].linear.z()); }
  double impulse(std::size_t contact) const { return double(islands_.patches[contact].point[0].impulse); }

  Islands<Scalar> islands_;
  std::unique_ptr<StepSolver<Scalar>> solver_;
};

using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Arrays, Precisions);

TYPED_TEST(Arrays, TheGroundBearsWhatLiesOnIt) {
  const std::size_t lower = this->add_body(2, {0, 0, 0});
  const std::size_t upper = this->add_body(3, {0, 0, 0});
  this->add_contact(upper, lower);
  this->add_contact(lower, this->ground());
  // The first ticks find what contacts bear, and give way by.
  for (int tick = 0; tick < 120; ++tick) {
    this->solve();
    double moved[2];  // m
    for (const std::size_t body : {lower, upper}) {
      this->islands_.bodies[body].linear += this->islands_.solved[body].linear;
      moved[body] = double(this->islands_.bodies[body].linear.z()) * kTick +
                    double(this->islands_.solved[body].way.z());
    }
    this->islands_.patches[0].point[0].gap += TypeParam(moved[upper] - moved[lower]);
    this->islands_.patches[1].point[0].gap += TypeParam(moved[lower]);
  }
  EXPECT_NEAR(this->impulse(0), 3 * kGravity * kTick, 1e-3);
  EXPECT_NEAR(this->impulse(1), 5 * kGravity * kTick, 1e-3);
  EXPECT_NEAR(this->change(upper), 0, 1e-4);
}

TYPED_TEST(Arrays, ElasticBodiesOfOneMassExchangeVelocitiesAndKeepMomentum) {
  const std::size_t below = this->add_body(1, {0, 0, 2}, /*is_heavy=*/false);
  const std::size_t above = this->add_body(1, {0, 0, -1}, /*is_heavy=*/false);
  this->add_contact(above, below, /*restitution=*/1);
  this->solve();
  EXPECT_NEAR(this->change(above), 3, 1e-5);
  EXPECT_NEAR(this->change(below), -3, 1e-5);
  EXPECT_TRUE(this->islands_.solved[above].is_pushed);
}

TYPED_TEST(Arrays, WhatBouncesButBearsNothingIsInFreeFlight) {
  const std::size_t body = this->add_body(1, {0, 0, 5}, /*is_heavy=*/false);
  this->add_contact(body, this->ground(), /*restitution=*/0.5);
  this->solve();
  EXPECT_EQ(this->impulse(0), 0);
  EXPECT_FALSE(this->islands_.solved[body].is_pushed);
}

TYPED_TEST(Arrays, WhatElseIsInTheArraysChangesNoBit) {
  Islands<TypeParam> alone;
  for (const bool has_company : {false, true}) {
    this->islands_ = {};
    const std::size_t body = this->add_body(2, {0, 0, -1});
    if (has_company) this->add_body(50, {0, 0, -3});
    this->add_contact(body, this->ground());
    if (has_company) this->add_contact(1, this->ground(), 0.5);
    this->solve();
    if (!has_company) alone = this->islands_;
  }
  EXPECT_EQ(this->islands_.solved[0].linear, alone.solved[0].linear);
  EXPECT_EQ(this->islands_.solved[0].way, alone.solved[0].way);
  EXPECT_EQ(this->impulse(0), double(alone.patches[0].point[0].impulse));
}

TYPED_TEST(Arrays, AJointHoldsWhatHangsOnIt) {
  JointForm ball{.type = JointType::kBall};
  ball.in_child.position = {0, 0, 1};
  const JointDrives drives{};
  IslandJoint joint{
      .id = JointId{1}, .form = &ball, .drives = &drives, .child = this->add_body(2, {0, 0, 0})};
  joint.fixed_parent.position = {0, 0, 1};
  this->islands_.joints.push_back(joint);
  this->solve();
  EXPECT_NEAR(this->change(0), 0, 1e-5);
  EXPECT_TRUE(this->solver_->blamed().empty());
}

// A body on a joint to the world, with a drive that may give way, and a contact that may slip or bounce.
template <typename Scalar>
class DrawnIsland {
 public:
  using Vector = typename Islands<Scalar>::Vector;

  explicit DrawnIsland(std::mt19937& dice) : dice_(dice) {
    constexpr JointType kTypes[] = {JointType::kPrismatic, JointType::kRevolute, JointType::kBall,
                                    JointType::kUniversal};
    form_.type = kTypes[dice() % std::size(kTypes)];
    form_.in_child.position = vector().template cast<double>();
    form_.axes[0].lower = -0.1;
    form_.axes[0].upper = 0.1;
    drives_[0] = {.mode = DriveMode::kVelocity, .target = double(number())};
    form_.axes[0].effort_max = 100 * std::abs(double(number()));
    velocity_ = 3 * vector();
    patch_.restitution = dice() % 2 == 0 ? Scalar(0.5) : Scalar(0);
    patch_.friction = std::abs(number());
    patch_.points = 1;
    patch_.point[0] = {.lever_a = vector(),
                       .lever_b = vector(),
                       .normal = (vector() + 2 * Vector::UnitZ()).normalized(),
                       .impulse = std::abs(number())};
    patch_.friction_impulse = vector();
  }

  JointForm form_;
  JointDrives drives_{};
  Vector velocity_;
  typename Islands<Scalar>::Patch patch_;

 private:
  Scalar number() { return Scalar(dice_()) / Scalar(std::mt19937::max()) * 2 - 1; }
  Vector vector() {
    const Scalar x = number();
    const Scalar y = number();
    return {x, y, number()};
  }

  std::mt19937& dice_;
};

TYPED_TEST(Arrays, NorOfWhatIsOnJoints) {
  std::mt19937 dice(1);
  for (int n = 0; n < 300; ++n) {
    const DrawnIsland<TypeParam> both[] = {DrawnIsland<TypeParam>(dice), DrawnIsland<TypeParam>(dice)};
    Islands<TypeParam> alone;
    for (const std::size_t company : {0u, 1u}) {
      this->islands_ = {};
      for (std::size_t place = 0; place <= company; ++place)
        this->add_body(2, both[place + 1 - company].velocity_);
      this->ground();
      for (std::size_t place = 0; place <= company; ++place) {
        const DrawnIsland<TypeParam>& island = both[place + 1 - company];
        this->islands_.joints.push_back(
            {.id = JointId{place + 1}, .form = &island.form_, .drives = &island.drives_, .child = place});
        this->islands_.contacts.push_back({place, 1, island.patch_.restitution > 0});
        this->islands_.patches.push_back(island.patch_);
        this->islands_.patches.back().a = place;
        this->islands_.patches.back().b = this->islands_.fixed();
      }
      this->solve();
      if (company == 0) alone = this->islands_;
    }
    const auto& in_company = this->islands_.solved[1];
    ASSERT_EQ(in_company.linear, alone.solved[0].linear) << n;
    ASSERT_EQ(in_company.angular, alone.solved[0].angular) << n;
    ASSERT_EQ(in_company.way, alone.solved[0].way) << n;
    ASSERT_EQ(in_company.turn, alone.solved[0].turn) << n;
    ASSERT_EQ(this->islands_.patches[1].friction_impulse, alone.patches[0].friction_impulse) << n;
  }
}

TYPED_TEST(Arrays, OverlapsAreOpenedAsIfTheyWereNoDeeperThanAShareOfTheExtent) {
  const Opening<TypeParam> usual(kTick, 4, 4);
  EXPECT_NEAR(double(usual.deepest_gap(1, 1)), -0.06, 1e-6);
  EXPECT_NEAR(double(usual.deepest_gap(TypeParam(0.001), 1)), -0.001, 1e-6);
  const Opening<TypeParam> many(kTick, 4, 64);
  EXPECT_EQ(many.deepest_gap(1, 1), usual.deepest_gap(1, 1));
  EXPECT_GT(many.deepest_gap(1, 100), usual.deepest_gap(1, 100)) << "what turns easily is opened more slowly";
}

TYPED_TEST(Arrays, AnIslandTakesWhatItsContactsOrJointsAskFor) {
  JointForm hinge{.type = JointType::kRevolute};
  const JointDrives drives{};
  for (const double rate : {0.0, 50.0}) {
    const std::size_t body = this->add_body(1, {0, 0, 0});
    this->islands_.bodies[body].angular.y() = TypeParam(rate);
    this->islands_.joints.push_back(
        {.id = JointId{body + 1}, .form = &hinge, .drives = &drives, .child = body});
  }
  const std::size_t free = this->add_body(1, {0, 0, 0});
  const IslandEnd ends[] = {{1, 0, 1, 2}, {2, 0, 2, 2}, {free + 1, 0, 2, 16}};
  IslandSteps<TypeParam> steps;
  const ContactNeeds needs{Substepping{}};
  const std::span<const int> of = steps.of(ends, this->islands_, needs, kTick);
  ASSERT_EQ(of.size(), 3u);
  EXPECT_EQ(of[0], needs.for_turn(0));
  EXPECT_EQ(of[1], needs.for_turn(50 * kTick));
  EXPECT_GT(of[1], of[0]);
  EXPECT_EQ(of[2], 16);
}

}  // namespace
}  // namespace tessera
