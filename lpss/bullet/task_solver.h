// Bullet's sequential impulses over one task, for ticks of one step: bodies, clones and contacts of any
// number of worlds, and joints.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstddef>
#include <vector>

#include "lpss/bullet/joint_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// One task at a time: set_up(), then round(n) for each n below rounds(), then finish(). No state is kept for
// the next task.
class TaskSolver final : public btSequentialImpulseConstraintSolver {
 public:
  explicit TaskSolver(const EngineSettings& settings);

  // A round is a pass over all rows.
  int rounds() const { return info_.m_numIterations; }

  // Makes the rows. The task must hold at least one body.
  void set_up(const SolveTask& task, double dt);

  // One pass of the position correction and one of the velocities; the two touch different variables, so this
  // is as good as all of the one before all of the other.
  void round(int n);

  // Writes velocities, corrected poses and impulses back.
  void finish();

 private:
  // A clone maps to the solver body of its original.
  struct Link {
    btCollisionObject* clone;
    btCollisionObject* original;
  };

  void convertBodies(btCollisionObject** bodies, int count, const btContactSolverInfo& info) override;
  void begin_joints();
  void release_kinematic_bodies();

  btContactSolverInfo info_;
  btContactSolverInfo one_pass_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<Link> links_;
  std::vector<btPersistentManifold*> manifolds_;
  JointSolver joints_;
};

}  // namespace tessera::bullet
