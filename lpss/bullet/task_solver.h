// Bullet's sequential impulses over one task: bodies, clones and contacts of any number of worlds, and
// joints.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "lpss/bullet/joint_solver.h"
#include "lpss/bullet/substep_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// One task at a time: set_up(), then passes() times pass(), then finish(). No state is kept for the
// next task.
class TaskSolver final : public btSequentialImpulseConstraintSolver {
 public:
  explicit TaskSolver(const EngineSettings& settings);

  // Of all rows, or the rounds of small steps.
  int passes() const { return substep_solver_ ? substep_solver_->rounds() : info_.m_numIterations; }

  // The number of substeps (>= 2), if the settings specify substeps.
  void take_substep_solver(int steps) { substep_solver_->set_steps(steps); }

  // Makes the rows. The task must hold at least one body.
  void set_up(const SolveTask& task, double dt);

  // Makes a body `times` lighter for the passes, after set_up().
  void split(std::size_t body, double times);

  // n counts from 0. Without small steps: one pass of the position correction and one of the velocities; the
  // two touch different variables, so this is as good as all of the one before all of the other.
  void pass(int n);

  // Writes velocities, corrected poses and impulses back.
  void finish();

  // The change of a body by rows so far, from set_up() to finish(); `body` is an index into the task's
  // bodies. Without substeps it includes warm starting after set_up().
  VelocityChange change(std::size_t body) const;
  void set_change(std::size_t body, const VelocityChange& change);

 private:
  // A clone maps to the solver body of its original.
  struct Link {
    btCollisionObject* clone;
    btCollisionObject* original;
  };

  void convertBodies(btCollisionObject** bodies, int count, const btContactSolverInfo& info) override;
  void add_joint(const TaskJoint& joint);
  void begin_steps();
  void begin_joints();
  int place_of(std::size_t body) const { return bodies_[body]->getCompanionId(); }
  void release_kinematic_bodies();

  std::optional<SubstepSolver> substep_solver_;
  bool has_begun_ = false;  // to pass
  btContactSolverInfo info_;
  btContactSolverInfo one_pass_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<Link> links_;
  std::vector<btPersistentManifold*> manifolds_;
  JointSolver joints_;
};

}  // namespace tessera::bullet
