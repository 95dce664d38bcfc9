// Islands over any number of worlds, solved by Bullet's sequential impulses.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <vector>

#include "lpss/engine/engine.h"

namespace tessera::bullet {

class BulletSolver final : public IslandSolver {
 public:
  explicit BulletSolver(const EngineSettings& settings);

  void solve(const SolveTask& task, double dt) override;

 private:
  // Bullet's solver, with clones that stand for the solver body of their original.
  class CloningSolver final : public btSequentialImpulseConstraintSolver {
   public:
    struct Link {
      btCollisionObject* clone;
      btCollisionObject* original;
    };
    std::vector<Link> links;

   protected:
    void convertBodies(btCollisionObject** bodies, int count, const btContactSolverInfo& info) override;
    btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                           const btContactSolverInfo& info) override;
  };

  btContactSolverInfo info_;
  CloningSolver solver_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<btPersistentManifold*> manifolds_;
};

}  // namespace tessera::bullet
