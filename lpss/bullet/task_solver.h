// Bullet's sequential impulses over one task: bodies, clones and contacts of any number of worlds, and
// joints.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "lpss/bullet/joint_rows.h"
#include "lpss/bullet/small_steps.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// The same settings for a solver that passes over the whole tick.
EngineSettings without_small_steps(EngineSettings settings);

// One task at a time: set_up(), then solve(), or passes() times pass(), then finish(). Nothing of a task
// stays for the next.
class TaskSolver final : public btSequentialImpulseConstraintSolver {
 public:
  explicit TaskSolver(const EngineSettings& settings);

  int passes() const { return info_.m_numIterations; }

  // How many small steps (>= 2) follow, where the settings ask for some.
  void take_small_steps(int steps) { small_steps_->set_steps(steps); }

  // Makes the rows and applies what they start warm from. The task must hold at least one body.
  void set_up(const SolveTask& task, double dt);

  // Makes a body `times` lighter for the passes, after set_up().
  void split(std::size_t body, double times);

  // All passes, or all small steps where the settings ask for some: then the task must have no joints.
  void solve();

  // One pass of the position correction and one of the velocities; n counts from 0. The two touch different
  // variables, so this is as good as all of the one before all of the other.
  void pass(int n);

  // Writes velocities, corrected poses and impulses back.
  void finish();

  // What the passes make of a body; `body` is a place in the task's bodies. From set_up() to finish().
  btSolverBody& solver_body(std::size_t body);
  const btSolverBody& solver_body(std::size_t body) const;

 private:
  // A clone stands for the solver body of its original.
  struct Link {
    btCollisionObject* clone;
    btCollisionObject* original;
  };

  struct Joint {
    btCollisionObject* child;
    btCollisionObject* parent;
    std::size_t row_count;
  };

  void convertBodies(btCollisionObject** bodies, int count, const btContactSolverInfo& info) override;
  void convertJoints(btTypedConstraint** none, int count, const btContactSolverInfo& info) override;
  void add_joint(const TaskJoint& joint, double dt);
  void convert_row(const JointRow& row, int child, int parent, btSolverConstraint& converted);
  void release_kinematic_bodies();

  std::optional<SmallSteps> small_steps_;
  btContactSolverInfo info_;
  btContactSolverInfo one_pass_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<Link> links_;
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<Joint> joints_;
  std::vector<JointRow> rows_;  // of joints_, one after the other
  btCollisionObject world_;     // what does not move
};

}  // namespace tessera::bullet
