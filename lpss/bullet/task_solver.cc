#include "lpss/bullet/task_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <span>

#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

Body& body_of(const WorldBody& body) { return static_cast<BulletWorld*>(body.world)->body(body.slot); }

btRigidBody& rigid_of(const WorldBody& body) { return body_of(body).rigid; }

JointSide side_of(const btRigidBody& rigid) {
  const btTransform& pose = rigid.getWorldTransform();
  return {{to_eigen(pose.getOrigin()), Eigen::Quaterniond(to_eigen(pose.getBasis())).normalized()},
          to_eigen(rigid.getLinearVelocity()),
          to_eigen(rigid.getAngularVelocity())};
}

PosedJoint posed(const TaskJoint& joint) {
  PosedJoint posed;
  posed.child = side_of(rigid_of(joint.child));
  posed.child_frame = posed.child.pose * joint.properties->in_child;
  if (joint.parent.world) {
    posed.parent = side_of(rigid_of(joint.parent));
    posed.parent.pose.position += joint.parent_origin;
    posed.parent_frame = posed.parent.pose * joint.properties->in_parent;
  } else {
    posed.parent = {joint.fixed_parent, joint.fixed_velocity, joint.fixed_spin};
    posed.parent_frame = joint.fixed_parent;
  }
  return posed;
}

// The velocity that a row sees before the first pass.
double velocity_of(const JointRow& row, const btSolverBody& child, const btSolverBody& parent) {
  const btVector3 child_linear = child.m_linearVelocity + child.m_externalForceImpulse;
  const btVector3 child_angular = child.m_angularVelocity + child.m_externalTorqueImpulse;
  const btVector3 parent_linear = parent.m_linearVelocity + parent.m_externalForceImpulse;
  const btVector3 parent_angular = parent.m_angularVelocity + parent.m_externalTorqueImpulse;
  return row.linear.dot(to_eigen(child_linear) - to_eigen(parent_linear)) +
         row.angular_child.dot(to_eigen(child_angular)) - row.angular_parent.dot(to_eigen(parent_angular));
}

// The change of angular velocity by a unit of a row's impulse.
btVector3 angular_response(const btSolverBody& body, const btVector3& angular) {
  if (!body.m_originalBody) return {0, 0, 0};
  return body.m_originalBody->getInvInertiaTensorWorld() * angular;
}

// The change of a row's velocity on one side by a unit of its impulse.
double mobility(const btSolverBody& body, const btVector3& linear, const btVector3& angular,
                const btVector3& response) {
  return double(linear.length2()) * body.m_invMass.x() + double(angular.dot(response));
}

// The mass side of a row: what a unit of its impulse does to its two bodies.
class Response {
 public:
  Response(const btSolverBody& child, const btSolverBody& parent)
      : mobility_(double(child.m_invMass.x()) + double(parent.m_invMass.x())),
        child_(inverse_inertia(child)),
        parent_(inverse_inertia(parent)) {}

  // The change of the velocity of row `a` by a unit of the impulse of row `b`.
  double operator()(const JointRow& a, const JointRow& b) const {
    return mobility_ * a.linear.dot(b.linear) + a.angular_child.dot(child_ * b.angular_child) +
           a.angular_parent.dot(parent_ * b.angular_parent);
  }

 private:
  static Eigen::Matrix3d inverse_inertia(const btSolverBody& body) {
    if (!body.m_originalBody) return Eigen::Matrix3d::Zero();
    return to_eigen(body.m_originalBody->getInvInertiaTensorWorld());
  }

  double mobility_;
  Eigen::Matrix3d child_;
  Eigen::Matrix3d parent_;
};

// Replaces the rows of a joint by combinations that do not disturb what its other rows hold (Gram-Schmidt in
// the metric of the inverse masses), so that one pass solves a joint exactly: row by row, ten passes leave a
// fifth of the error of a cantilever, which then sags. Impulses of drives and limits mean what they meant.
void decouple(std::span<JointRow> rows, const btSolverBody& child, const btSolverBody& parent) {
  constexpr double kDependent = 1e-9;  // of its mobility is left of a row that the others imply
  const Response response(child, parent);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double before = response(rows[i], rows[i]);
    for (std::size_t j = 0; j < i; ++j) {
      const double hold = response(rows[j], rows[j]);
      if (!rows[j].is_held || !(hold > 0)) continue;
      const double share = response(rows[i], rows[j]) / hold;
      rows[i].linear -= share * rows[j].linear;
      rows[i].angular_child -= share * rows[j].angular_child;
      rows[i].angular_parent -= share * rows[j].angular_parent;
      rows[i].velocity -= share * rows[j].velocity;
    }
    if (response(rows[i], rows[i]) > kDependent * before) continue;
    rows[i] = JointRow{};
  }
}

template <typename T>
std::span<T> span_of(btAlignedObjectArray<T>& array) {
  if (array.size() == 0) return {};
  return {&array[0], static_cast<std::size_t>(array.size())};
}

// Makes one side of a row that many times easier to move.
void lighten(btSolverConstraint& row, int id, const btSolverBody& body, double times) {
  const bool is_a = row.m_solverBodyIdA == id;
  if (!is_a && row.m_solverBodyIdB != id) return;
  const btVector3& linear = is_a ? row.m_contactNormal1 : row.m_contactNormal2;
  const btVector3& angular = is_a ? row.m_relpos1CrossNormal : row.m_relpos2CrossNormal;
  btVector3& response = is_a ? row.m_angularComponentA : row.m_angularComponentB;
  const double added = (times - 1) * mobility(body, linear, angular, response);
  response *= btScalar(times);
  if (!(row.m_jacDiagABInv > 0)) return;
  const btScalar share(1 / (1 + added * row.m_jacDiagABInv));
  row.m_jacDiagABInv *= share;
  row.m_rhs *= share;
  row.m_rhsPenetration *= share;
  row.m_cfm *= share;
}

}  // namespace

EngineSettings without_small_steps(EngineSettings settings) {
  settings.substeps = 1;
  return settings;
}

TaskSolver::TaskSolver(const EngineSettings& settings) {
  if (settings.substeps > 1) small_steps_.emplace(settings.substeps, settings.solver_iterations);
  info_.m_warmstartingFactor = btScalar(settings.warm_starting);
  info_.m_splitImpulsePenetrationThreshold = btScalar(-settings.split_from);
  info_.m_numIterations = settings.solver_iterations;
  info_.m_solverMode = SOLVER_USE_WARMSTARTING;
  if (settings.friction_in_two_directions) info_.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  // No early exit: how many passes an island gets must not depend on what else is in the task.
  info_.m_leastSquaresResidualThreshold = -1;
  one_pass_ = info_;
  one_pass_.m_numIterations = 1;
}

void TaskSolver::set_up(const SolveTask& task, double dt) {
  bodies_.clear();
  links_.clear();
  manifolds_.clear();
  joints_.clear();
  rows_.clear();
  for (const WorldBody& body : task.bodies) {
    body_of(body).fine.reset();
    bodies_.push_back(&rigid_of(body));
  }
  for (const SolveTask::CloneOf& clone : task.clones) {
    links_.push_back({&rigid_of(clone.clone), bodies_[clone.original]});
  }
  for (const WorldPair& contact : task.contacts) {
    const auto manifolds = static_cast<BulletWorld*>(contact.world)->manifolds_of(contact.pair);
    manifolds_.insert(manifolds_.end(), manifolds.begin(), manifolds.end());
  }
  for (const TaskJoint& joint : task.joints) add_joint(joint, dt);
  info_.m_timeStep = one_pass_.m_timeStep = btScalar(dt);
  solveGroupCacheFriendlySetup(bodies_.data(), static_cast<int>(bodies_.size()), manifolds_.data(),
                               static_cast<int>(manifolds_.size()), nullptr, 0, info_, nullptr);
  release_kinematic_bodies();
}

void TaskSolver::split(std::size_t body, double times) {
  const int id = bodies_[body]->getCompanionId();
  btSolverBody& split = m_tmpSolverBodyPool[id];
  for (btConstraintArray* rows :
       {&m_tmpSolverNonContactConstraintPool, &m_tmpSolverContactConstraintPool,
        &m_tmpSolverContactFrictionConstraintPool, &m_tmpSolverContactRollingFrictionConstraintPool}) {
    for (int i = 0; i < rows->size(); ++i) lighten((*rows)[i], id, split, times);
  }
  split.m_invMass *= btScalar(times);
}

void TaskSolver::solve() {
  if (!small_steps_) {
    for (int n = 0; n < passes(); ++n) pass(n);
    return;
  }
  RowPools pools;
  pools.bodies = span_of(m_tmpSolverBodyPool);
  pools.contacts = span_of(m_tmpSolverContactConstraintPool);
  pools.frictions = span_of(m_tmpSolverContactFrictionConstraintPool);
  pools.friction_directions = info_.m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS ? 2 : 1;
  small_steps_->solve(pools, info_);
}

void TaskSolver::pass(int n) {
  solveGroupCacheFriendlySplitImpulseIterations(nullptr, 0, nullptr, 0, nullptr, 0, one_pass_, nullptr);
  solveSingleIteration(n, nullptr, 0, nullptr, 0, nullptr, 0, info_, nullptr);
}

void TaskSolver::finish() {
  // Bullet would write the impulses of joints to constraints of its own.
  m_tmpSolverNonContactConstraintPool.resizeNoInitialize(0);
  // It takes the companion back from every body that has a solver body: the originals.
  solveGroupCacheFriendlyFinish(bodies_.data(), static_cast<int>(bodies_.size()), info_);
  for (const Link& link : links_) link.clone->setCompanionId(-1);
}

btSolverBody& TaskSolver::solver_body(std::size_t body) {
  return m_tmpSolverBodyPool[bodies_[body]->getCompanionId()];
}

const btSolverBody& TaskSolver::solver_body(std::size_t body) const {
  return m_tmpSolverBodyPool[bodies_[body]->getCompanionId()];
}

void TaskSolver::convertBodies(btCollisionObject** bodies, int count, const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertBodies(bodies, count, info);
  for (const Link& link : links_) link.clone->setCompanionId(link.original->getCompanionId());
}

// A parent that nothing can push is the world to Bullet: its motion goes into the rows, and nothing is noted
// in a body that other tasks may use at the same time.
void TaskSolver::add_joint(const TaskJoint& joint, double dt) {
  const PosedJoint at = posed(joint);
  const std::size_t first = rows_.size();
  append_joint_rows(*joint.properties, *joint.drives, at, dt, rows_);
  btRigidBody* parent = joint.parent.world ? &rigid_of(joint.parent) : nullptr;
  if (!parent || parent->isStaticOrKinematicObject()) {
    for (std::size_t i = first; i < rows_.size(); ++i) {
      rows_[i].velocity += rows_[i].linear.dot(at.parent.linear_velocity) +
                           rows_[i].angular_parent.dot(at.parent.angular_velocity);
    }
    parent = nullptr;
  }
  joints_.push_back({&rigid_of(joint.child), parent ? parent : &world_, rows_.size() - first});
}

void TaskSolver::convertJoints(btTypedConstraint**, int, const btContactSolverInfo& info) {
  m_tmpSolverNonContactConstraintPool.resizeNoInitialize(static_cast<int>(rows_.size()));
  int row = 0;
  for (const Joint& joint : joints_) {
    const int child = getOrInitSolverBody(*joint.child, info.m_timeStep);
    const int parent = getOrInitSolverBody(*joint.parent, info.m_timeStep);
    decouple(std::span(rows_).subspan(static_cast<std::size_t>(row), joint.row_count),
             m_tmpSolverBodyPool[child], m_tmpSolverBodyPool[parent]);
    for (std::size_t i = 0; i < joint.row_count; ++i, ++row) {
      convert_row(rows_[static_cast<std::size_t>(row)], child, parent,
                  m_tmpSolverNonContactConstraintPool[row]);
    }
  }
}

// Not by Bullet's own convertJoint(): it has no rows for bodies heavier than 1e7 kg (m^2), and diverges with
// any compliance above the mobility of the row, since it leaves it out of the row's diagonal.
void TaskSolver::convert_row(const JointRow& row, int child, int parent, btSolverConstraint& converted) {
  const btSolverBody& child_body = m_tmpSolverBodyPool[child];
  const btSolverBody& parent_body = m_tmpSolverBodyPool[parent];
  converted = btSolverConstraint();
  converted.m_solverBodyIdA = child;
  converted.m_solverBodyIdB = parent;
  converted.m_contactNormal1 = to_bullet(row.linear);
  converted.m_contactNormal2 = -converted.m_contactNormal1;
  converted.m_relpos1CrossNormal = to_bullet(row.angular_child);
  converted.m_relpos2CrossNormal = -to_bullet(row.angular_parent);
  converted.m_angularComponentA = angular_response(child_body, converted.m_relpos1CrossNormal);
  converted.m_angularComponentB = angular_response(parent_body, converted.m_relpos2CrossNormal);
  const double mobile = mobility(child_body, converted.m_contactNormal1, converted.m_relpos1CrossNormal,
                                 converted.m_angularComponentA) +
                        mobility(parent_body, converted.m_contactNormal2, converted.m_relpos2CrossNormal,
                                 converted.m_angularComponentB);
  const double resistance = mobile + row.compliance;
  const double impulse_per_velocity = resistance > 0 ? 1 / resistance : 0;
  converted.m_jacDiagABInv = btScalar(impulse_per_velocity);
  converted.m_cfm = btScalar(row.compliance * impulse_per_velocity);
  converted.m_rhs =
      btScalar((row.velocity - velocity_of(row, child_body, parent_body)) * impulse_per_velocity);
  converted.m_lowerLimit = btScalar(row.impulse_min);
  converted.m_upperLimit = btScalar(row.impulse_max);
  converted.m_overrideNumSolverIterations = info_.m_numIterations;
}

// Once rows are made, nothing is left to do with bodies that cannot be pushed; other parts may meet them,
// too.
void TaskSolver::release_kinematic_bodies() {
  for (int i = static_cast<int>(bodies_.size()); i < m_tmpSolverBodyPool.size(); ++i) {
    btRigidBody*& original = m_tmpSolverBodyPool[i].m_originalBody;
    if (!original || !original->isKinematicObject()) continue;
    original->setCompanionId(-1);
    original = nullptr;
  }
}

}  // namespace tessera::bullet
