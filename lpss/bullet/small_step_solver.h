// Solves islands in small steps: their contacts by lpss/solver/contact_solver.h, their joints by
// joint_solver.h, in turns.
#pragma once

#include <LinearMath/btVector3.h>

#include <unordered_map>
#include <vector>

#include "lpss/bullet/joint_solver.h"
#include "lpss/engine/engine.h"
#include "lpss/solver/contact_solver.h"

class btManifoldPoint;
class btPersistentManifold;
class btRigidBody;

namespace tessera::bullet {

// One task at a time: set_up(), then round(n) for each n below rounds(), then finish(). No state is kept for
// the next task.
class SmallStepSolver {
 public:
  explicit SmallStepSolver(const EngineSettings& settings);

  // The task must hold at least one body. `steps` (>= 2) in this tick of `dt` seconds; by default those of
  // the settings.
  void set_up(const SolveTask& task, double dt) { set_up(task, dt, settings_.substeps); }
  void set_up(const SolveTask& task, double dt, int steps);

  // A step is a round that starts it, biased passes, and a relaxed one; the last round of all ends the tick.
  int rounds() const { return steps_ * (passes_ + 1) + 1; }
  void round(int n);

  // Writes velocities, corrected poses and impulses back.
  void finish();

 private:
  using Contacts = ContactSolver<btScalar>;

  // The points of a patch, in the order of its rows.
  struct PatchPoints {
    btManifoldPoint* point[kPatchPointsMax];
  };

  void add_body(btRigidBody& rigid);
  std::size_t place_of(const btRigidBody& rigid);
  void add_manifold(btPersistentManifold& manifold);
  void begin();
  void begin_joints();
  template <typename Act>
  void with_joints(Act act);
  void correct_jointed();
  void write_impulses();
  void write_bodies();

  EngineSettings settings_;
  int passes_;  // of a step, biased and relaxed
  int steps_;
  double dt_ = 0;  // s
  Contacts contacts_;
  JointSolver joints_;
  std::vector<btRigidBody*> rigids_;  // of the dynamic bodies, which come first
  std::vector<btRigidBody*> clones_;
  std::vector<Contacts::Body> bodies_;
  std::vector<bool> is_pushed_;  // has rows
  std::unordered_map<const btRigidBody*, std::size_t> kinematics_;
  std::size_t fixed_ = 0;  // the place of what neither moves nor can be pushed
  std::vector<Contacts::Patch> patches_;
  std::vector<PatchPoints> points_;
  std::vector<std::size_t> jointed_;
  std::vector<btVector3> linear_changes_;  // of jointed bodies since the start of the tick
  std::vector<btVector3> angular_changes_;
  std::vector<Contacts::Motion> corrections_;  // of rigids_
};

}  // namespace tessera::bullet
