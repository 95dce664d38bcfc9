#include "lpss/bullet/bullet_solver.h"

#include "lpss/bullet/bullet_world.h"

namespace tessera::bullet {
namespace {

btCollisionObject* object_of(const WorldBody& body) {
  return &static_cast<BulletWorld*>(body.world)->body(body.slot).rigid;
}

}  // namespace

void BulletSolver::CloningSolver::convertBodies(btCollisionObject** bodies, int count,
                                                const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertBodies(bodies, count, info);
  for (const Link& link : links) link.clone->setCompanionId(link.original->getCompanionId());
}

btScalar BulletSolver::CloningSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                                    const btContactSolverInfo& info) {
  // Bullet takes the companion back from every body that has a solver body: originals and kinematic bodies.
  const btScalar residual =
      btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
  for (const Link& link : links) link.clone->setCompanionId(-1);
  return residual;
}

BulletSolver::BulletSolver(const EngineSettings& settings) {
  info_.m_numIterations = settings.solver_iterations;
  info_.m_solverMode = SOLVER_USE_WARMSTARTING;
  if (settings.friction_in_two_directions) info_.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  // No early exit: how many passes an island gets must not depend on what else is in the task.
  info_.m_leastSquaresResidualThreshold = -1;
}

void BulletSolver::solve(const SolveTask& task, double dt) {
  if (task.bodies.empty()) return;
  bodies_.clear();
  manifolds_.clear();
  solver_.links.clear();
  for (const WorldBody& body : task.bodies) bodies_.push_back(object_of(body));
  for (const SolveTask::CloneOf& clone : task.clones) {
    solver_.links.push_back({object_of(clone.clone), bodies_[clone.original]});
  }
  for (const WorldPair& contact : task.contacts) {
    for (btPersistentManifold* manifold :
         static_cast<BulletWorld*>(contact.world)->manifolds_of(contact.pair)) {
      manifolds_.push_back(manifold);
    }
  }
  info_.m_timeStep = btScalar(dt);
  solver_.solveGroup(bodies_.data(), static_cast<int>(bodies_.size()), manifolds_.data(),
                     static_cast<int>(manifolds_.size()), nullptr, 0, info_, nullptr, nullptr);
}

}  // namespace tessera::bullet
