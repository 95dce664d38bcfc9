#include "lpss/bullet/joint_solver.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include "lpss/bullet/conversions.h"
#include "lpss/engine/disjoint_sets.h"
#include "lpss/grid/invariant.h"

namespace tessera::bullet {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

// By this share of what holds it, a row gives way, so that rows which imply one another have a solution.
constexpr double kGivesWay = 1e-9;

// A row of which less is left by what is held is held itself.
constexpr double kFree = 1e-9;

// rad, in one tick. What turns farther moves step by step.
constexpr double kTurnWhole = 0.25;

// rad, in one step. Where a body turns farther, its arc is not foreseen: Newton's method would diverge.
constexpr double kTurnForeseen = 0.7;

constexpr Index kNumbers = 6;  // of a body's velocities: linear, angular

}  // namespace

class JointSolver::Assembly {
 public:
  Assembly(std::vector<Joint> joints, std::span<const JointedBody> bodies, double dt, int steps);

  void start_step();
  void pass();
  void move();
  void end(std::vector<Moved>& moved);

 private:
  // A joint, with the places of its bodies in bodies_.
  struct Tie {
    Joint joint;
    Index child;
    std::optional<Index> parent;
    std::vector<JointRow> rows;
  };

  // A row over the velocities of all bodies whose impulses leave alone what is held.
  struct FreeRow {
    VectorXd row;
    VectorXd response;    // of the velocities to a unit of impulse
    VectorXd shares;      // of what is held, that were taken out of the row
    double mobility = 0;  // of the row's own velocity
    double velocity = 0;  // wanted of the row before
    double compliance = 0;
    double impulse_min = 0;
    double impulse_max = 0;
    double impulse = 0;
  };

  struct Body {
    JointedBody now;
    Moved moved;
  };

  void find_whether_to_move();
  bool turns_beyond(double turn, const VectorXd& velocities, double time) const;
  void make_rows();
  // Rows as the columns of a matrix.
  SparseMatrix columns(bool is_held) const;
  SparseMatrix inverse_masses() const;
  void add_free_rows(const SparseMatrix& inverse_masses);
  void hold(VectorXd& velocities) const;
  PosedJoint after(const Tie& tie, const VectorXd& velocities, double time) const;
  VectorXd excess(const VectorXd& velocities) const;
  void hold_at_end(VectorXd& velocities);
  void advance();
  VectorXd velocities() const;
  void set_velocities(const VectorXd& velocities);

  std::vector<Tie> ties_;
  std::vector<Body> bodies_;
  int steps_;           // of the tick
  bool moves_ = false;  // from step to step
  double span_;         // s, over which rows hold: a tick, or a step of those that move
  SparseMatrix held_;
  SparseMatrix response_;  // of the velocities to a unit of impulse of each
  VectorXd wanted_;
  VectorXd wanted_now_;  // were nothing to turn
  Eigen::SimplicialLDLT<SparseMatrix> factors_;
  std::vector<FreeRow> free_rows_;
  std::vector<VectorXd> ways_;  // the velocities of steps that bodies are still to be moved by
};

JointSolver::Assembly::Assembly(std::vector<Joint> joints, std::span<const JointedBody> bodies, double dt,
                                int steps)
    : steps_(steps), span_(dt) {
  std::map<int, Index> places;
  const auto place_of = [&](int body) {
    const auto [place, is_new] = places.emplace(body, static_cast<Index>(bodies_.size()));
    if (is_new) {
      bodies_.push_back({bodies[static_cast<std::size_t>(body)],
                         {body, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity()}});
    }
    return place->second;
  };
  for (Joint& joint : joints) {
    Tie& tie = ties_.emplace_back();
    tie.child = place_of(joint.child);
    if (joint.parent) tie.parent = place_of(*joint.parent);
    tie.joint = std::move(joint);
  }
  make_rows();
}

// As the velocities are now: a whip cracks within a tick.
void JointSolver::Assembly::find_whether_to_move() {
  if (moves_ || steps_ == 1) return;
  VectorXd held = velocities();
  hold(held);
  if (!turns_beyond(kTurnWhole, velocities(), span_) && !turns_beyond(kTurnWhole, held, span_)) return;
  moves_ = true;
  span_ /= steps_;
}

bool JointSolver::Assembly::turns_beyond(double turn, const VectorXd& velocities, double time) const {
  for (Index first = 0; first < velocities.size(); first += kNumbers) {
    if (!(velocities.segment<3>(first + 3).norm() * time <= turn)) return true;
  }
  return false;
}

// The motion of a parent that nothing can push goes into the rows.
void JointSolver::Assembly::make_rows() {
  std::vector<double> wanted;
  for (Tie& tie : ties_) {
    const Joint& joint = tie.joint;
    tie.rows.clear();
    append_joint_rows(*joint.properties, *joint.drives, joint.posed, span_, moves_ ? steps_ : 1, tie.rows);
    for (JointRow& row : tie.rows) {
      if (!tie.parent) {
        const JointSide& parent = joint.posed.parent;
        row.velocity +=
            row.linear.dot(parent.linear_velocity) + row.angular_parent.dot(parent.angular_velocity);
      }
      if (row.is_held) wanted.push_back(row.velocity);
    }
  }
  wanted_ = Eigen::Map<const VectorXd>(wanted.data(), static_cast<Index>(wanted.size()));
  wanted_now_ = wanted_;
  held_ = columns(/*is_held=*/true);
  const SparseMatrix masses = inverse_masses();
  response_ = masses * held_;
  SparseMatrix matrix = held_.transpose() * response_;
  for (Index i = 0; i < matrix.rows(); ++i) matrix.coeffRef(i, i) *= 1 + kGivesWay;
  factors_.compute(matrix);
  invariant(factors_.info() == Eigen::Success, "what joints hold can be solved for");
  add_free_rows(masses);
}

SparseMatrix JointSolver::Assembly::columns(bool is_held) const {
  std::vector<Eigen::Triplet<double>> entries;
  Index column = 0;
  const auto append = [&](Index body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    const Index first = kNumbers * body;
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, column, linear[i]);
      entries.emplace_back(first + 3 + i, column, angular[i]);
    }
  };
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (row.is_held != is_held) continue;
      append(tie.child, row.linear, row.angular_child);
      if (tie.parent) append(*tie.parent, -row.linear, -row.angular_parent);
      ++column;
    }
  }
  SparseMatrix matrix(kNumbers * static_cast<Index>(bodies_.size()), column);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

SparseMatrix JointSolver::Assembly::inverse_masses() const {
  std::vector<Eigen::Triplet<double>> entries;
  Index first = 0;
  for (const Body& body : bodies_) {
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, first + i, body.now.inverse_mass);
      for (Index j = 0; j < 3; ++j)
        entries.emplace_back(first + 3 + i, first + 3 + j, body.now.inverse_inertia(i, j));
    }
    first += kNumbers;
  }
  SparseMatrix matrix(first, first);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Takes out of each row what is held, in the metric of the inverse masses. Rows that are made anew go on from
// the impulses of the step before.
void JointSolver::Assembly::add_free_rows(const SparseMatrix& masses) {
  const std::vector<FreeRow> before = std::exchange(free_rows_, {});
  const SparseMatrix rows = columns(/*is_held=*/false);
  const double parts = moves_ ? 1 : steps_;  // of what a row's impulse is shared among
  Index column = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (row.is_held) continue;
      FreeRow free;
      free.row = rows.col(column++);
      const double whole = free.row.dot(masses * free.row);
      free.shares = factors_.solve(response_.transpose() * free.row);
      free.row -= held_ * free.shares;
      free.response = masses * free.row;
      free.mobility = free.row.dot(free.response);
      if (!(free.mobility > kFree * whole)) continue;
      free.velocity = row.velocity;
      free.compliance = row.compliance * parts;
      free.impulse_min = row.impulse_min / parts;
      free.impulse_max = row.impulse_max / parts;
      free_rows_.push_back(std::move(free));
    }
  }
  if (before.size() != free_rows_.size()) return;
  for (std::size_t i = 0; i < before.size(); ++i) {
    FreeRow& free = free_rows_[i];
    free.impulse = std::clamp(before[i].impulse, free.impulse_min, free.impulse_max);
  }
}

VectorXd JointSolver::Assembly::velocities() const {
  VectorXd velocities(kNumbers * static_cast<Index>(bodies_.size()));
  Index first = 0;
  for (const auto& [now, moved] : bodies_) {
    velocities.segment<3>(first) = now.linear + to_eigen(*now.linear_change);
    velocities.segment<3>(first + 3) = now.angular + to_eigen(*now.angular_change);
    first += kNumbers;
  }
  return velocities;
}

void JointSolver::Assembly::set_velocities(const VectorXd& velocities) {
  Index first = 0;
  for (const auto& [now, moved] : bodies_) {
    *now.linear_change = to_bullet(Eigen::Vector3d(velocities.segment<3>(first) - now.linear));
    *now.angular_change = to_bullet(Eigen::Vector3d(velocities.segment<3>(first + 3) - now.angular));
    first += kNumbers;
  }
}

void JointSolver::Assembly::start_step() {
  find_whether_to_move();
  if (moves_) {
    advance();
    make_rows();
  }
  if (free_rows_.empty()) return;
  VectorXd moved = velocities();
  for (const FreeRow& free : free_rows_) moved += free.response * free.impulse;
  set_velocities(moved);
}

void JointSolver::Assembly::hold(VectorXd& velocities) const {
  velocities += response_ * factors_.solve(wanted_ - held_.transpose() * velocities);
}

// Both sides of a joint after a time at these velocities.
PosedJoint JointSolver::Assembly::after(const Tie& tie, const VectorXd& velocities, double time) const {
  const auto moved_by = [&](JointSide side, Index body) {
    side.linear_velocity = velocities.segment<3>(kNumbers * body);
    side.angular_velocity = velocities.segment<3>(kNumbers * body + 3);
    return bullet::moved(side, time);
  };
  PosedJoint end = tie.joint.posed;
  end.child = moved_by(end.child, tie.child);
  end.parent = tie.parent ? moved_by(end.parent, *tie.parent) : bullet::moved(end.parent, time);
  return end;
}

// By how much more than what may be left of it each error will be off once the bodies have moved.
VectorXd JointSolver::Assembly::excess(const VectorXd& velocities) const {
  VectorXd excess(wanted_.size());
  std::vector<JointRow> rows;
  Index n = 0;
  for (const Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.properties, after(tie, velocities, span_), span_, rows);
    for (std::size_t i = 0; i < rows.size(); ++i, ++n) {
      excess[n] = rows[i].error - kErrorLeft * tie.rows[i].error;
    }
  }
  return excess;
}

// One step of Newton's method towards no excess. What turns too fast for that is held along its rows as they
// are.
void JointSolver::Assembly::hold_at_end(VectorXd& velocities) {
  hold(velocities);
  if (turns_beyond(kTurnForeseen, velocities, span_)) {
    wanted_ = wanted_now_;
  } else {
    wanted_ -= excess(velocities) / span_;
  }
  hold(velocities);
}

void JointSolver::Assembly::pass() {
  VectorXd moved = velocities();
  hold_at_end(moved);
  for (FreeRow& free : free_rows_) {
    const double missing =
        free.velocity - free.shares.dot(wanted_) - free.row.dot(moved) - free.compliance * free.impulse;
    const double impulse = std::clamp(free.impulse + missing / (free.mobility + free.compliance),
                                      free.impulse_min, free.impulse_max);
    moved += free.response * (impulse - free.impulse);
    free.impulse = impulse;
  }
  set_velocities(moved);
}

void JointSolver::Assembly::move() { ways_.push_back(velocities()); }

// To where move() has found the bodies to come in the steps before.
void JointSolver::Assembly::advance() {
  for (const VectorXd& velocities : ways_) {
    for (Tie& tie : ties_) tie.joint.posed = after(tie, velocities, span_);
    Index first = 0;
    for (auto& [now, moved] : bodies_) {
      const Eigen::Quaterniond turn = rotation(velocities.segment<3>(first + 3) * span_);
      const Eigen::Matrix3d axes = turn.toRotationMatrix();
      now.inverse_inertia = axes * now.inverse_inertia * axes.transpose();
      moved.way += velocities.segment<3>(first) * span_;
      moved.turn = (turn * moved.turn).normalized();
      first += kNumbers;
    }
  }
  ways_.clear();
}

void JointSolver::Assembly::end(std::vector<Moved>& moved) {
  if (!moves_) return;
  advance();
  for (const Body& body : bodies_) moved.push_back(body.moved);
}

JointedBody jointed(btSolverBody& body) {
  const btRigidBody& rigid = *body.m_originalBody;
  const double inverse_mass = body.m_invMass.x();
  JointedBody jointed;
  jointed.inverse_mass = inverse_mass;
  // The solver may have made the body lighter than it is.
  jointed.inverse_inertia = to_eigen(rigid.getInvInertiaTensorWorld()) * (inverse_mass / rigid.getInvMass());
  jointed.linear = to_eigen(body.m_linearVelocity);
  jointed.angular = to_eigen(body.m_angularVelocity);
  jointed.linear_change = &body.m_deltaLinearVelocity;
  jointed.angular_change = &body.m_deltaAngularVelocity;
  return jointed;
}

JointSolver::JointSolver() = default;
JointSolver::~JointSolver() = default;

void JointSolver::clear() {
  joints_.clear();
  assemblies_.clear();
}

std::vector<int> JointSolver::bodies() const {
  std::vector<int> bodies;
  for (const Joint& joint : joints_) {
    bodies.push_back(joint.child);
    if (joint.parent) bodies.push_back(*joint.parent);
  }
  return bodies;
}

void JointSolver::set_up(std::span<const JointedBody> bodies, double dt, int steps) {
  DisjointSets sets(bodies.size());
  for (const Joint& joint : joints_) {
    if (joint.parent)
      sets.unite(static_cast<std::size_t>(joint.child), static_cast<std::size_t>(*joint.parent));
  }
  std::map<std::size_t, std::vector<Joint>> assemblies;
  for (const Joint& joint : joints_) {
    assemblies[sets.find(static_cast<std::size_t>(joint.child))].push_back(joint);
  }
  for (auto& [first, joints] : assemblies) {
    assemblies_.push_back(std::make_unique<Assembly>(std::move(joints), bodies, dt, steps));
  }
}

void JointSolver::start_step() {
  for (const auto& assembly : assemblies_) assembly->start_step();
}

void JointSolver::pass() {
  for (const auto& assembly : assemblies_) assembly->pass();
}

void JointSolver::move() {
  for (const auto& assembly : assemblies_) assembly->move();
}

std::vector<JointSolver::Moved> JointSolver::end() {
  std::vector<Moved> moved;
  for (const auto& assembly : assemblies_) assembly->end(moved);
  return moved;
}

}  // namespace tessera::bullet
