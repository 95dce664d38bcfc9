#include "lpss/bullet/task_solver.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/free_motion.h"
#include "lpss/bullet/task_joint.h"

namespace tessera::bullet {
namespace {

// The change of a row's velocity on one side by a unit of its impulse.
double mobility(const btSolverBody& body, const btVector3& linear, const btVector3& angular,
                const btVector3& response) {
  return double(linear.length2()) * body.m_invMass.x() + double(angular.dot(response));
}

// Makes one side of a row this many times lighter.
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

TaskSolver::TaskSolver(const EngineSettings& settings) {
  info_.m_warmstartingFactor = btScalar(settings.warm_starting);
  info_.m_splitImpulsePenetrationThreshold = btScalar(-settings.split_from);
  info_.m_numIterations = settings.solver_iterations;
  info_.m_solverMode = SOLVER_USE_WARMSTARTING;
  if (settings.friction_in_two_directions) info_.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  // No early exit: the number of passes of an island must not depend on other islands in the task.
  info_.m_leastSquaresResidualThreshold = -1;
  one_pass_ = info_;
  one_pass_.m_numIterations = 1;
}

void TaskSolver::set_up(const SolveTask& task, double dt) {
  bodies_.clear();
  links_.clear();
  manifolds_.clear();
  joints_.clear();
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
  info_.m_timeStep = one_pass_.m_timeStep = btScalar(dt);
  solveGroupCacheFriendlySetup(bodies_.data(), static_cast<int>(bodies_.size()), manifolds_.data(),
                               static_cast<int>(manifolds_.size()), nullptr, 0, info_, nullptr);
  release_kinematic_bodies();
  for (const TaskJoint& joint : task.joints) joints_.add(solved_joint(joint));
}

void TaskSolver::split(std::size_t body, double times) {
  const int id = bodies_[body]->getCompanionId();
  btSolverBody& split = m_tmpSolverBodyPool[id];
  for (btConstraintArray* rows :
       {&m_tmpSolverContactConstraintPool, &m_tmpSolverContactFrictionConstraintPool,
        &m_tmpSolverContactRollingFrictionConstraintPool}) {
    for (int i = 0; i < rows->size(); ++i) lighten((*rows)[i], id, split, times);
  }
  split.m_invMass *= btScalar(times);
}

void TaskSolver::round(int n) {
  if (n == 0) begin_joints();
  solveGroupCacheFriendlySplitImpulseIterations(nullptr, 0, nullptr, 0, nullptr, 0, one_pass_, nullptr);
  solveSingleIteration(n, nullptr, 0, nullptr, 0, nullptr, 0, info_, nullptr);
  joints_.pass();
}

void TaskSolver::finish() {
  correct_poses();
  // It resets the companion of every body with a solver body: the originals.
  solveGroupCacheFriendlyFinish(bodies_.data(), static_cast<int>(bodies_.size()), info_);
  for (const Link& link : links_) link.clone->setCompanionId(-1);
}

// In Bullet's place, whose sin and cos are those of the C library.
void TaskSolver::correct_poses() {
  for (int i = 0; i < m_tmpSolverBodyPool.size(); ++i) {
    btSolverBody& body = m_tmpSolverBodyPool[i];
    if (!body.m_originalBody || (body.m_pushVelocity.isZero() && body.m_turnVelocity.isZero())) continue;
    body.m_worldTransform = after(body.m_worldTransform, body.m_pushVelocity,
                                  body.m_turnVelocity * info_.m_splitImpulseTurnErp, info_.m_timeStep);
    body.m_pushVelocity.setZero();
    body.m_turnVelocity.setZero();
  }
}

VelocityChange TaskSolver::change(std::size_t body) const {
  const btSolverBody& solved = m_tmpSolverBodyPool[place_of(body)];
  return {to_eigen(solved.m_deltaLinearVelocity), to_eigen(solved.m_deltaAngularVelocity),
          to_eigen(solved.m_pushVelocity), to_eigen(solved.m_turnVelocity)};
}

void TaskSolver::set_change(std::size_t body, const VelocityChange& change) {
  btSolverBody& solved = m_tmpSolverBodyPool[place_of(body)];
  solved.m_deltaLinearVelocity = to_bullet(change.linear);
  solved.m_deltaAngularVelocity = to_bullet(change.angular);
  solved.m_pushVelocity = to_bullet(change.push);
  solved.m_turnVelocity = to_bullet(change.turn);
}

void TaskSolver::convertBodies(btCollisionObject** bodies, int count, const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertBodies(bodies, count, info);
  for (const Link& link : links_) link.clone->setCompanionId(link.original->getCompanionId());
}

void TaskSolver::begin_joints() {
  if (joints_.is_empty()) return;
  std::vector<JointedBody> bodies(static_cast<std::size_t>(m_tmpSolverBodyPool.size()));
  for (const int place : joints_.bodies()) {
    btSolverBody& body = m_tmpSolverBodyPool[place];
    JointedBody& into = bodies[static_cast<std::size_t>(place)] = jointed(body);
    into.linear += to_eigen(body.m_externalForceImpulse);
    into.angular += to_eigen(body.m_externalTorqueImpulse);
  }
  joints_.set_up(bodies, info_.m_timeStep, 1);
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
