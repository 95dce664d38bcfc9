#include "lpss/bullet/joint_solver.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "lpss/bullet/conversions.h"
#include "lpss/grid/invariant.h"
#include "lpss/engine/disjoint_sets.h"

namespace tessera::bullet {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

// By this share of what holds it, a row gives way, so that rows which imply one another have a solution.
constexpr double kGivesWay = 1e-9;

// A row of which less is left by what is held is held itself.
constexpr double kFree = 1e-9;

// rad, in one tick. Where a body turns faster, its arc is not foreseen: Newton's method would diverge.
constexpr double kTurnForeseen = 0.7;

constexpr Index kNumbers = 6;  // of a body's velocities: linear, angular

}  // namespace

class JointSolver::Assembly {
 public:
  Assembly(std::vector<const Joint*> joints, std::span<const JointedBody> bodies, double dt, int steps);

  void start_step();
  void pass();

 private:
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

  // Rows as the columns of a matrix.
  SparseMatrix columns(bool is_held) const;
  SparseMatrix inverse_masses() const;
  void add_free_rows(const SparseMatrix& inverse_masses, int steps);
  void hold(VectorXd& moving) const;
  VectorXd excess(const VectorXd& moving) const;
  bool turns_fast(const VectorXd& moving) const;
  void hold_at_end(VectorXd& moving);
  VectorXd velocities() const;
  void set_velocities(const VectorXd& velocities);

  const std::vector<const Joint*> joints_;
  const double dt_;
  std::vector<JointedBody> bodies_;
  std::map<int, Index> places_;  // in bodies_, by those in the task
  SparseMatrix held_;
  SparseMatrix response_;  // of the velocities to a unit of impulse of each
  VectorXd wanted_;
  VectorXd wanted_now_;  // were nothing to turn
  Eigen::SimplicialLDLT<SparseMatrix> factors_;
  std::vector<FreeRow> free_rows_;
};

JointSolver::Assembly::Assembly(std::vector<const Joint*> joints, std::span<const JointedBody> bodies,
                                double dt, int steps)
    : joints_(std::move(joints)), dt_(dt) {
  std::vector<double> wanted;
  const auto add = [&](int body) {
    if (places_.emplace(body, bodies_.size()).second)
      bodies_.push_back(bodies[static_cast<std::size_t>(body)]);
  };
  for (const Joint* joint : joints_) {
    add(joint->child);
    if (joint->parent) add(*joint->parent);
    for (const JointRow& row : joint->rows) {
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
  add_free_rows(masses, steps);
}

SparseMatrix JointSolver::Assembly::columns(bool is_held) const {
  std::vector<Eigen::Triplet<double>> entries;
  Index column = 0;
  const auto append = [&](int body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    const Index first = kNumbers * places_.at(body);
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, column, linear[i]);
      entries.emplace_back(first + 3 + i, column, angular[i]);
    }
  };
  for (const Joint* joint : joints_) {
    for (const JointRow& row : joint->rows) {
      if (row.is_held != is_held) continue;
      append(joint->child, row.linear, row.angular_child);
      if (joint->parent) append(*joint->parent, -row.linear, -row.angular_parent);
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
  for (const JointedBody& body : bodies_) {
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, first + i, body.inverse_mass);
      for (Index j = 0; j < 3; ++j)
        entries.emplace_back(first + 3 + i, first + 3 + j, body.inverse_inertia(i, j));
    }
    first += kNumbers;
  }
  SparseMatrix matrix(first, first);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Takes out of each row what is held, in the metric of the inverse masses.
void JointSolver::Assembly::add_free_rows(const SparseMatrix& masses, int steps) {
  const SparseMatrix rows = columns(/*is_held=*/false);
  Index column = 0;
  for (const Joint* joint : joints_) {
    for (const JointRow& row : joint->rows) {
      if (row.is_held) continue;
      FreeRow free;
      free.row = rows.col(column++);
      const double before = free.row.dot(masses * free.row);
      free.shares = factors_.solve(response_.transpose() * free.row);
      free.row -= held_ * free.shares;
      free.response = masses * free.row;
      free.mobility = free.row.dot(free.response);
      if (!(free.mobility > kFree * before)) continue;
      free.velocity = row.velocity;
      free.compliance = row.compliance * steps;
      free.impulse_min = row.impulse_min / steps;
      free.impulse_max = row.impulse_max / steps;
      free_rows_.push_back(std::move(free));
    }
  }
}

VectorXd JointSolver::Assembly::velocities() const {
  VectorXd velocities(kNumbers * static_cast<Index>(bodies_.size()));
  Index first = 0;
  for (const JointedBody& body : bodies_) {
    velocities.segment<3>(first) = body.linear + to_eigen(*body.linear_change);
    velocities.segment<3>(first + 3) = body.angular + to_eigen(*body.angular_change);
    first += kNumbers;
  }
  return velocities;
}

void JointSolver::Assembly::set_velocities(const VectorXd& velocities) {
  Index first = 0;
  for (const JointedBody& body : bodies_) {
    *body.linear_change = to_bullet(Eigen::Vector3d(velocities.segment<3>(first) - body.linear));
    *body.angular_change = to_bullet(Eigen::Vector3d(velocities.segment<3>(first + 3) - body.angular));
    first += kNumbers;
  }
}

void JointSolver::Assembly::start_step() {
  if (free_rows_.empty()) return;
  VectorXd moved = velocities();
  for (const FreeRow& free : free_rows_) moved += free.response * free.impulse;
  set_velocities(moved);
}

void JointSolver::Assembly::hold(VectorXd& moving) const {
  moving += response_ * factors_.solve(wanted_ - held_.transpose() * moving);
}

// By how much more than what may be left of it each error will be off once the bodies have moved.
VectorXd JointSolver::Assembly::excess(const VectorXd& moving) const {
  const auto at_end = [&](JointSide side, int body) {
    const Index first = kNumbers * places_.at(body);
    side.linear_velocity = moving.segment<3>(first);
    side.angular_velocity = moving.segment<3>(first + 3);
    return moved(side, dt_);
  };
  VectorXd excess(wanted_.size());
  std::vector<JointRow> rows;
  Index n = 0;
  for (const Joint* joint : joints_) {
    PosedJoint end = joint->posed;
    end.child = at_end(end.child, joint->child);
    end.parent = joint->parent ? at_end(end.parent, *joint->parent) : moved(end.parent, dt_);
    rows.clear();
    append_held_rows(*joint->properties, end, dt_, rows);
    for (std::size_t i = 0; i < rows.size(); ++i, ++n) {
      excess[n] = rows[i].error - kErrorLeft * joint->rows[i].error;
    }
  }
  return excess;
}

bool JointSolver::Assembly::turns_fast(const VectorXd& moving) const {
  for (Index first = 0; first < moving.size(); first += kNumbers) {
    if (!(moving.segment<3>(first + 3).norm() * dt_ <= kTurnForeseen)) return true;
  }
  return false;
}

// One step of Newton's method towards no excess. What turns too fast for that is held along its rows as they
// are.
void JointSolver::Assembly::hold_at_end(VectorXd& moving) {
  hold(moving);
  if (turns_fast(moving)) {
    wanted_ = wanted_now_;
  } else {
    wanted_ -= excess(moving) / dt_;
  }
  hold(moving);
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
  std::map<std::size_t, std::vector<const Joint*>> assemblies;
  for (const Joint& joint : joints_) {
    assemblies[sets.find(static_cast<std::size_t>(joint.child))].push_back(&joint);
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

}  // namespace tessera::bullet
