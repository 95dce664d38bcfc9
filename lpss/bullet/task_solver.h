// Bullet's sequential impulses over one task, for ticks of one step: bodies and contacts of a world, and
// joints: those of lpss/joints.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstddef>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/joints/joint_solver.h"

namespace tessera::bullet {

// No state is kept for the next task.
class TaskSolver final : public btSequentialImpulseConstraintSolver {
 public:
  explicit TaskSolver(const EngineSettings& settings);

  // The task must hold at least one body.
  void solve(const SolveTask& task, double dt);

 private:
  void set_up(const SolveTask& task, double dt);
  void begin_joints();
  void pass(int n);
  void pass_over_joints();
  void finish();
  void correct_poses();
  void drop_unbounded_impulses();
  void release_kinematic_bodies();

  struct Jointed {
    btSolverBody* body;
    joints::JointSolver::Place place;
    joints::JointAssembly::Velocities before;
    joints::JointAssembly::Velocities change;  // as Bullet has it since the last pass over joints
  };

  btContactSolverInfo info_;
  btContactSolverInfo one_pass_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<btPersistentManifold*> manifolds_;
  joints::JointSolver joints_;
  std::vector<Jointed> jointed_;
};

}  // namespace tessera::bullet
