// The dynamics of trees, against closed forms and against Newton's and Euler's laws for each body.
#include "lpss/joints/tree_dynamics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace tessera::joints {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kG = 9.81;

Quaterniond turned(double angle, const Vector3d& axis) {
  return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

TreeBody body(double mass, const Vector3d& moments, const JointSide& side) {
  const Matrix3d axes = side.pose.orientation.toRotationMatrix();
  return {mass, axes * moments.asDiagonal() * axes.transpose(), side, {0, 0, -mass * kG}};
}

void expect_equal(const Eigen::MatrixXd& found, const Eigen::MatrixXd& wanted, double error = 1e-12) {
  ASSERT_EQ(found.rows(), wanted.rows());
  ASSERT_EQ(found.cols(), wanted.cols());
  EXPECT_LT((found - wanted).cwiseAbs().maxCoeff(), error) << found << "\n\nin the place of\n\n" << wanted;
}

TEST(TreeDynamics, AFreeBodyHasItsMassAndItsInertia) {
  JointSide side;
  side.pose = {{5, -3, 2}, turned(0.7, {1, 2, 3})};
  side.linear_velocity = {1, 2, 3};
  side.angular_velocity = {-2, 0.5, 4};
  const TreeBody free = body(3, {0.2, 0.3, 0.4}, side);
  const TreeDynamics dynamics(std::vector{free}, {}, {});
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(6, 6);
  mass.topLeftCorner<3, 3>() = 3 * Matrix3d::Identity();
  mass.bottomRightCorner<3, 3>() = free.inertia;
  expect_equal(dynamics.mass_matrix(), mass);
  VectorXd bias(6);
  bias << 0, 0, 3 * kG, side.angular_velocity.cross(Vector3d(free.inertia * side.angular_velocity));
  expect_equal(dynamics.efforts(VectorXd::Zero(6)), bias);
  VectorXd velocities(6);
  velocities << side.linear_velocity, side.angular_velocity;
  expect_equal(dynamics.velocities(), velocities);
  const Vector3d point(0.1, -0.2, 0.3);
  VectorXd moves(6);
  moves << side.linear_velocity + side.angular_velocity.cross(side.pose.orientation * point),
      side.angular_velocity;
  expect_equal(dynamics.jacobian(0, point) * velocities, moves);
}

// Hinges about y at the upper end of links whose centres are `centre` m below; a positive angle swings them
// to -x.
JointForm hinge(double above, double centre) {
  JointForm form;
  form.type = JointType::kRevolute;
  const Quaterniond y = Quaterniond::FromTwoVectors(Vector3d::UnitX(), Vector3d::UnitY());
  form.in_parent = {{0, 0, -above}, y};
  form.in_child = {{0, 0, centre}, y};
  return form;
}

TEST(TreeDynamics, APendulumHasItsClosedForm) {
  const JointForm form = hinge(0, 0.7);
  const double q = 0.6;
  const JointSide bob = placed_child(form, {}, {.position = {q}, .velocity = {2}});
  const std::vector bodies{body(2, {0.1, 0.2, 0.3}, bob)};
  const std::vector<TreeJoint> joints{{&form, std::nullopt, 0}};
  const TreeDynamics dynamics(bodies, joints, {});
  const double mass = 0.2 + 2 * 0.7 * 0.7;
  const double bias = 2 * kG * 0.7 * std::sin(q);
  EXPECT_NEAR(dynamics.mass_matrix()(0, 0), mass, 1e-12);
  EXPECT_NEAR(dynamics.efforts(VectorXd::Zero(1))[0], bias, 1e-12);
  EXPECT_NEAR(dynamics.efforts(VectorXd::Constant(1, 3))[0], bias + 3 * mass, 1e-12);
  EXPECT_NEAR(dynamics.velocities()[0], 2, 1e-12);
}

// Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, 2006, section 7.4: the planar elbow; angles from
// straight down.
TEST(TreeDynamics, ADoublePendulumHasItsClosedForm) {
  const double m1 = 2, m2 = 3, c1 = 0.4, c2 = 0.3, l1 = 1, i1 = 0.05, i2 = 0.07;
  const Vector2d q(0.5, -1.1), v(1.5, -2.5);
  const JointForm first = hinge(0, c1);
  const JointForm second = hinge(l1 - c1, c2);
  const JointSide upper = placed_child(first, {}, {.position = {q[0]}, .velocity = {v[0]}});
  const JointSide lower = placed_child(second, upper, {.position = {q[1]}, .velocity = {v[1]}});
  const std::vector bodies{body(m1, {0.1, i1, 0.1}, upper), body(m2, {0.1, i2, 0.1}, lower)};
  const std::vector<TreeJoint> joints{{&first, std::nullopt, 0}, {&second, 0, 1}};
  const TreeDynamics dynamics(bodies, joints, {});
  const double cosine = std::cos(q[1]);
  Eigen::Matrix2d mass;
  mass(0, 0) = m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + 2 * l1 * c2 * cosine) + i1 + i2;
  mass(0, 1) = mass(1, 0) = m2 * (c2 * c2 + l1 * c2 * cosine) + i2;
  mass(1, 1) = m2 * c2 * c2 + i2;
  const double h = -m2 * l1 * c2 * std::sin(q[1]);
  Vector2d bias(h * v[1] * v[0] + h * (v[0] + v[1]) * v[1], -h * v[0] * v[0]);
  bias[0] += (m1 * c1 + m2 * l1) * kG * std::sin(q[0]) + m2 * c2 * kG * std::sin(q[0] + q[1]);
  bias[1] += m2 * c2 * kG * std::sin(q[0] + q[1]);
  expect_equal(dynamics.mass_matrix(), mass);
  expect_equal(dynamics.efforts(VectorXd::Zero(2)), bias);
  expect_equal(dynamics.velocities(), v);
  const Vector2d a(0.7, -4);
  expect_equal(dynamics.efforts(a), mass * a + bias);
}

// A pole, hinged at its lower end, on a cart along x; the angle from upright, towards x.
TEST(TreeDynamics, ACartAndPoleHaveTheirClosedForm) {
  const double cart_mass = 5, m = 0.8, l = 0.6, inertia = 0.11;
  const double angle = 0.4, rate = 2.2;
  JointForm rail;
  rail.type = JointType::kPrismatic;
  JointForm pivot = hinge(0, -l);
  const JointSide cart = placed_child(rail, {}, {.position = {3}, .velocity = {1.5}});
  const JointSide pole = placed_child(pivot, cart, {.position = {angle}, .velocity = {rate}});
  const std::vector bodies{body(cart_mass, {1, 1, 1}, cart), body(m, {0.1, inertia, 0.1}, pole)};
  const std::vector<TreeJoint> joints{{&rail, std::nullopt, 0}, {&pivot, 0, 1}};
  const TreeDynamics dynamics(bodies, joints, {});
  Eigen::Matrix2d mass;
  mass << cart_mass + m, m * l * std::cos(angle), m * l * std::cos(angle), inertia + m * l * l;
  expect_equal(dynamics.mass_matrix(), mass);
  expect_equal(dynamics.efforts(VectorXd::Zero(2)),
               Vector2d(-m * l * rate * rate * std::sin(angle), -m * kG * l * std::sin(angle)));
}

// A slider along x on a table that turns about z: it is driven outwards.
TEST(TreeDynamics, AGroundThatTurnsDrivesWhatHangsOnItOutwards) {
  JointForm rail;
  rail.type = JointType::kPrismatic;
  JointSide table;
  table.pose.position = {1, 0, 0};
  table.angular_velocity = {0, 0, 3};
  table.linear_velocity = {0.5, 0, 0};
  const JointSide slider = placed_child(rail, table, {.position = {2}, .velocity = {4}});
  const std::vector bodies{body(1.5, {1, 1, 1}, slider)};
  const std::vector<TreeJoint> joints{{&rail, std::nullopt, 0}};
  const TreeDynamics dynamics(bodies, joints, table);
  EXPECT_NEAR(dynamics.efforts(VectorXd::Zero(1))[0], -1.5 * 3 * 3 * 2, 1e-12);
}

// A tree with all types of joints, whose bodies move on smooth ways, at the time `t`.
class MovingTree {
 public:
  MovingTree() {
    const JointType types[] = {JointType::kBall,      JointType::kUniversal, JointType::kScrew,
                               JointType::kPrismatic, JointType::kRevolute,  JointType::kFixed};
    double n = 1;
    for (const JointType type : types) {
      JointForm& form = forms_.emplace_back();
      form.type = type;
      form.pitch = 0.3;
      form.in_parent = {{0.1 * n, -0.2, 0.05 * n}, turned(n, {1, n, -2})};
      form.in_child = {{-0.15, 0.1 * n, 0.2}, turned(-n, {n, 1, 0.5})};
      ++n;
    }
  }

  // What each joint hangs on when the first body is the root; the others follow in the order of joints.
  static constexpr std::size_t kParents[] = {0, 1, 2, 1, 0, 5};

  const JointForm& form(std::size_t joint) const { return forms_[joint]; }
  std::size_t joints() const { return forms_.size(); }

  std::vector<TreeBody> at(double t) const {
    const Vector3d axis = Vector3d(1, -1, 2).normalized();
    JointSide root;
    root.pose = {Vector3d(1, 2, 3) + Vector3d(0.5, -1, 2) * t + Vector3d(2, 3, -1) * t * t,
                 turned(0.3 + 1.5 * t - 2 * t * t, axis)};
    root.linear_velocity = Vector3d(0.5, -1, 2) + 2 * Vector3d(2, 3, -1) * t;
    root.angular_velocity = axis * (1.5 - 4 * t);
    std::vector<JointSide> sides{root};
    for (std::size_t n = 0; n < forms_.size(); ++n) {
      const auto number = static_cast<double>(n + 1);
      const double q = 0.4 * number - 1 + (2 - number) * t + 1.5 * number * t * t;
      const double v = 2 - number + 3 * number * t;
      const JointSide& parent = sides[kParents[n]];
      sides.push_back(forms_[n].type == JointType::kBall
                          ? on_ball(forms_[n], parent, q, v)
                          : placed_child(forms_[n], parent, {{q, 0.5 - q}, {v, -v}}));
    }
    std::vector<TreeBody> bodies;
    for (std::size_t n = 0; n < sides.size(); ++n) {
      const auto number = static_cast<double>(n + 1);
      bodies.push_back(body(number, {0.1 * number, 0.15 * number, 0.2}, sides[n]));
    }
    return bodies;
  }

 private:
  static JointSide on_ball(const JointForm& form, const JointSide& parent, double q, double v) {
    const Vector3d axis = Vector3d(2, 1, -1).normalized();
    JointSide child = placed_child(form, parent, {.ball = turned(q, axis)});
    const Vector3d lever = child.pose.orientation * form.in_child.position;
    child.linear_velocity += child.angular_velocity.cross(lever);
    child.angular_velocity += parent.pose.orientation * form.in_parent.orientation * (axis * v);
    child.linear_velocity -= child.angular_velocity.cross(lever);
    return child;
  }

  std::vector<JointForm> forms_;
};

// What Newton and Euler ask for each body, along the directions in which the tree is free to move.
void expect_laws_of_motion(const MovingTree& tree, const std::vector<TreeJoint>& joints,
                           const std::vector<std::size_t>& order) {
  constexpr double kStep = 1e-5;
  const auto bodies_at = [&](double t) {
    const std::vector<TreeBody> all = tree.at(t);
    std::vector<TreeBody> listed;
    for (const std::size_t n : order) listed.push_back(all[n]);
    return listed;
  };
  const auto dynamics_at = [&](double t) { return TreeDynamics(bodies_at(t), joints, {}); };
  const TreeDynamics now = dynamics_at(0);
  VectorXd accelerations = (dynamics_at(kStep).velocities() - dynamics_at(-kStep).velocities()) / (2 * kStep);
  const std::vector<TreeBody> bodies = bodies_at(0), before = bodies_at(-kStep), after = bodies_at(kStep);
  VectorXd wanted = VectorXd::Zero(now.freedoms());
  double energy = 0;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    const JointSide& side = bodies[n].side;
    const auto spin = [](const TreeBody& of) { return Vector3d(of.inertia * of.side.angular_velocity); };
    Eigen::Matrix<double, 6, 1> wrench, moves;
    wrench << (after[n].side.linear_velocity - before[n].side.linear_velocity) / (2 * kStep) *
                      bodies[n].mass -
                  bodies[n].force,
        (spin(after[n]) - spin(before[n])) / (2 * kStep);
    moves << side.linear_velocity, side.angular_velocity;
    const auto jacobian = now.jacobian(n, Vector3d::Zero());
    wanted += jacobian.transpose() * wrench;
    energy +=
        (bodies[n].mass * side.linear_velocity.squaredNorm() + side.angular_velocity.dot(spin(bodies[n]))) /
        2;
    expect_equal(jacobian * now.velocities(), moves, 1e-11);
  }
  expect_equal(now.efforts(accelerations), wanted, 1e-6);
  const VectorXd bias = now.efforts(VectorXd::Zero(now.freedoms()));
  expect_equal(now.efforts(accelerations), now.mass_matrix() * accelerations + bias, 1e-10);
  EXPECT_NEAR(now.velocities().dot(now.mass_matrix() * now.velocities()) / 2, energy, 1e-10);
}

TEST(TreeDynamics, AnyTreeThatFloatsFollowsTheLawsOfMotion) {
  const MovingTree tree;
  std::vector<TreeJoint> joints;
  std::vector<std::size_t> order{0};
  for (std::size_t n = 0; n < tree.joints(); ++n) {
    joints.push_back({&tree.form(n), MovingTree::kParents[n], n + 1});
    order.push_back(n + 1);
  }
  expect_laws_of_motion(tree, joints, order);
}

// From its body 3 on, which hangs on 2, 1 and 0: parents hang on their children.
TEST(TreeDynamics, ATreeFollowsThemFromAnyBodyOn) {
  const MovingTree tree;
  const std::vector<std::size_t> order{3, 2, 1, 0, 4, 5, 6};
  const std::vector<TreeJoint> joints{
      {&tree.form(2), 0, 1, false}, {&tree.form(1), 1, 2, false}, {&tree.form(0), 2, 3, false},
      {&tree.form(3), 2, 4, true},  {&tree.form(4), 3, 5, true},  {&tree.form(5), 5, 6, true},
  };
  expect_laws_of_motion(tree, joints, order);
}

}  // namespace
}  // namespace tessera::joints
