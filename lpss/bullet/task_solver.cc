#include "lpss/bullet/task_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/base/rotation.h"
#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/free_motion.h"
#include "lpss/model/limits.h"

namespace tessera::bullet {
namespace {

JointSide side_of(const btRigidBody& rigid) {
  const btTransform& pose = rigid.getWorldTransform();
  return {{to_eigen(pose.getOrigin()), Eigen::Quaterniond(to_eigen(pose.getBasis())).normalized()},
          to_eigen(rigid.getLinearVelocity()),
          to_eigen(rigid.getAngularVelocity())};
}

// Whether what moves a body into place is of numbers, and goes no farther than any body does.
bool is_bounded(const btSolverBody& body) {
  const Eigen::Vector3d push = to_eigen(body.m_pushVelocity);
  return push.squaredNorm() <= kSpeedMax * kSpeedMax && to_eigen(body.m_turnVelocity).allFinite();
}

// While bodies of the task store their places in the solver as companion ids.
joints::SolvedJoint solved_joint(const SolveTask& task, const IslandJoint& joint) {
  const btRigidBody& child = rigid_of(task.bodies[joint.child]);
  const btRigidBody* parent = joint.has_parent() ? &rigid_of(task.bodies[joint.parent]) : nullptr;
  std::optional<int> pushed;
  if (parent) pushed = parent->getCompanionId();
  std::optional<JointSide> parent_side;
  if (parent) parent_side = side_of(*parent);
  return {joint.id,   child.getCompanionId(), pushed,
          joint.form, joint.drives,           joints::posed(joint, side_of(child), parent_side)};
}

// As set up by Bullet, with the forces of the tick.
joints::JointedBody jointed(const btSolverBody& body) {
  const btRigidBody& rigid = *body.m_originalBody;
  const double inverse_mass = body.m_invMass.x();
  joints::JointedBody jointed;
  jointed.inverse_mass = inverse_mass;
  // The solver may have made the body lighter than it is.
  jointed.inverse_inertia = tensor_along<double>(to_eigen(rigid.getWorldTransform().getBasis()),
                                                 to_eigen(rigid.getInvInertiaDiagLocal())) *
                            (inverse_mass / rigid.getInvMass());
  jointed.linear = to_eigen(body.m_linearVelocity) + to_eigen(body.m_externalForceImpulse);
  jointed.angular = to_eigen(body.m_angularVelocity) + to_eigen(body.m_externalTorqueImpulse);
  return jointed;
}

joints::JointAssembly::Velocities change_of(const btSolverBody& body) {
  joints::JointAssembly::Velocities change;
  change << to_eigen(body.m_deltaLinearVelocity), to_eigen(body.m_deltaAngularVelocity);
  return change;
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

void TaskSolver::solve(const SolveTask& task, double dt) {
  set_up(task, dt);
  begin_joints();
  for (int n = 0; n < info_.m_numIterations; ++n) pass(n);
  finish();
}

// Makes the rows.
void TaskSolver::set_up(const SolveTask& task, double dt) {
  bodies_.clear();
  manifolds_.clear();
  joints_.clear();
  for (const WorldBody& body : task.bodies) {
    body_of(body).fine.reset();
    bodies_.push_back(&rigid_of(body));
  }
  for (const WorldPair& contact : task.contacts) {
    const auto manifolds = static_cast<BulletWorld*>(contact.world)->manifolds_of(contact.pair);
    manifolds_.insert(manifolds_.end(), manifolds.begin(), manifolds.end());
  }
  info_.m_timeStep = one_pass_.m_timeStep = btScalar(dt);
  solveGroupCacheFriendlySetup(bodies_.data(), static_cast<int>(bodies_.size()), manifolds_.data(),
                               static_cast<int>(manifolds_.size()), nullptr, 0, info_, nullptr);
  release_kinematic_bodies();
  for (const IslandJoint& joint : task.joints) joints_.add(solved_joint(task, joint));
}

// One pass of the position correction and one of the velocities; the two touch different variables, so this
// is as good as all of the one before all of the other.
void TaskSolver::pass(int n) {
  solveGroupCacheFriendlySplitImpulseIterations(nullptr, 0, nullptr, 0, nullptr, 0, one_pass_, nullptr);
  solveSingleIteration(n, nullptr, 0, nullptr, 0, nullptr, 0, info_, nullptr);
  pass_over_joints();
}

// What Bullet's rows have changed since the last time pushes the bodies of joints.
void TaskSolver::pass_over_joints() {
  for (Jointed& jointed : jointed_) {
    const joints::JointAssembly::Velocities push = change_of(*jointed.body) - jointed.change;
    if (!push.isZero(0)) jointed.place.assembly->push(jointed.place.body, push);
  }
  joints_.pass();
  for (Jointed& jointed : jointed_) {
    const auto change = (jointed.place.assembly->velocities(jointed.place.body) - jointed.before).eval();
    jointed.body->m_deltaLinearVelocity = to_bullet(Eigen::Vector3d(change.head<3>()));
    jointed.body->m_deltaAngularVelocity = to_bullet(Eigen::Vector3d(change.tail<3>()));
    jointed.change = change_of(*jointed.body);
  }
}

// Writes velocities, corrected poses and impulses back.
void TaskSolver::finish() {
  for (const joints::BodyMotion& moved : joints_.end()) {
    btSolverBody& body = m_tmpSolverBodyPool[moved.body];
    body.m_pushVelocity += to_bullet(Eigen::Vector3d(moved.way / info_.m_timeStep));
    body.m_turnVelocity += to_bullet(Eigen::Vector3d(
        rotation_vector(moved.turn) / (double(info_.m_timeStep) * double(info_.m_splitImpulseTurnErp))));
  }
  correct_poses();
  // It resets the companion of every body with a solver body: the originals.
  solveGroupCacheFriendlyFinish(bodies_.data(), static_cast<int>(bodies_.size()), info_);
  drop_unbounded_impulses();
}

// Impulses that no tick may start from are forgotten.
void TaskSolver::drop_unbounded_impulses() {
  constexpr double kMost = kMassMax * kSpeedMax;  // N s
  const auto is_within = [](btScalar impulse) { return std::abs(double(impulse)) <= kMost; };
  for (btPersistentManifold* manifold : manifolds_) {
    for (int n = 0; n < manifold->getNumContacts(); ++n) {
      btManifoldPoint& point = manifold->getContactPoint(n);
      if (is_within(point.m_appliedImpulse) && is_within(point.m_appliedImpulseLateral1) &&
          is_within(point.m_appliedImpulseLateral2))
        continue;
      point.m_appliedImpulse = point.m_appliedImpulseLateral1 = point.m_appliedImpulseLateral2 = 0;
    }
  }
}

// In Bullet's place, whose sin and cos are those of the C library.
void TaskSolver::correct_poses() {
  for (int i = 0; i < m_tmpSolverBodyPool.size(); ++i) {
    btSolverBody& body = m_tmpSolverBodyPool[i];
    if (!body.m_originalBody || (body.m_pushVelocity.isZero() && body.m_turnVelocity.isZero())) continue;
    if (!is_bounded(body)) {
      constexpr btScalar kNone = std::numeric_limits<btScalar>::quiet_NaN();
      body.m_linearVelocity.setValue(kNone, kNone, kNone);
      body.m_angularVelocity.setValue(kNone, kNone, kNone);
      body.m_pushVelocity.setZero();
      body.m_turnVelocity.setZero();
      continue;
    }
    body.m_worldTransform = after(body.m_worldTransform, body.m_pushVelocity,
                                  body.m_turnVelocity * info_.m_splitImpulseTurnErp, info_.m_timeStep);
    body.m_pushVelocity.setZero();
    body.m_turnVelocity.setZero();
  }
}

void TaskSolver::begin_joints() {
  jointed_.clear();
  if (joints_.is_empty()) return;
  std::vector<joints::JointedBody> bodies(static_cast<std::size_t>(m_tmpSolverBodyPool.size()));
  for (const std::size_t place : joints_.bodies())
    bodies[place] = jointed(m_tmpSolverBodyPool[static_cast<int>(place)]);
  joints_.set_up(bodies, info_.m_timeStep, 1);
  for (const std::size_t place : joints_.bodies()) {
    Jointed& jointed = jointed_.emplace_back();
    jointed.body = &m_tmpSolverBodyPool[static_cast<int>(place)];
    jointed.place = joints_.place_of(place);
    jointed.before << bodies[place].linear, bodies[place].angular;
    jointed.change.setZero();
  }
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
