// Solves contact rows that Bullet has set up for a tick in several substeps. Contacts are found once
// a tick, forces act step by step, and impulses carry over from step to step (Macklin et al., Small Steps in
// Physics Simulation, 2019; soft contacts and relaxation as in Catto, Solver2D, 2024).
#pragma once

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btSolverBody.h>
#include <BulletDynamics/ConstraintSolver/btSolverConstraint.h>

#include <span>
#include <vector>

#include "lpss/bullet/joint_solver.h"

namespace tessera::bullet {

// Bullet's data from its setup.
struct RowPools {
  std::span<btSolverBody> bodies;
  std::span<btSolverConstraint> contacts;
  std::span<btSolverConstraint> frictions;
  int friction_directions = 1;
};

// begin(), then for each n below rounds() round(n), then end(). In between, the solvers of the parts of an
// island may couple the bodies that they share.
class SubstepSolver {
 public:
  // `passes` (>= 1) over all rows are divided among `steps` (>= 2), at least two each.
  SubstepSolver(int steps, int passes);

  // With another number of steps (>= 2), with as many passes each. With more steps, contacts are stiffer by
  // the square of the ratio.
  void set_steps(int steps) { steps_ = steps; }

  int rounds() const { return steps_ * rounds_per_step() + 1; }

  // `info` is what the rows were set up with; `joints` have their rows.
  void begin(const RowPools& pools, JointSolver& joints, const btContactSolverInfo& info);
  void round(int n);

  // Writes velocities and impulses where Bullet's own solver would, and the correction of overlaps to the
  // push velocities. A body then moves by its final velocity, as without substeps, which conserves the energy
  // of falls and orbits. Bodies without rows are not changed.
  void end();

  // The change of a body's velocities by rows so far, by its index in the pool.
  btVector3 linear_change(std::size_t body) const { return motions_[body].linear - linear_force(body); }
  btVector3 angular_change(std::size_t body) const { return motions_[body].angular - angular_force(body); }
  void set_change(std::size_t body, const btVector3& linear, const btVector3& angular);

 private:
  // The change of a body's velocities since the start of the tick, which is rounded less than the velocities
  // themselves would be, and the displacement so far that only corrects overlaps.
  struct Motion {
    btVector3 linear;
    btVector3 angular;
    btVector3 way;
    btVector3 turn;
    btScalar inverse_mass;
    bool is_pushed = false;  // by any row, here or in another part
  };
  struct Contact {
    btScalar start;         // m/s, before the tick
    btScalar gap;           // m, in this step
    btScalar approach_max;  // m/s, at most 0: what closes the gap by the end of the tick
    btScalar rebound;       // m/s, required if the two have touched
    btScalar total = 0;     // N s, of all steps
  };

  struct Friction {
    btScalar start;
    btScalar total = 0;
  };

  // Of a step: the impulses of the step before, then passes, the last of which does not correct positions.
  int rounds_per_step() const { return passes_ + 1; }

  btVector3 linear_force(std::size_t body) const {
    return pools_.bodies[body].m_externalForceImpulse * forced_;
  }
  btVector3 angular_force(std::size_t body) const {
    return pools_.bodies[body].m_externalTorqueImpulse * forced_;
  }

  void begin_joints();
  void recall_impulses();
  btScalar velocity_change(const btSolverConstraint& row) const;
  void push(const btSolverConstraint& row, btScalar impulse);
  void set_impulse(btSolverConstraint& row, btScalar impulse);
  void start_step();
  void pass(bool corrects);
  void solve_contact(btSolverConstraint& row, const Contact& contact, bool corrects);
  void close_gaps();
  void add_way(btScalar time);
  void end_step();
  void rebound();
  void set_way(const BodyMotion& moved);

  int usual_steps_;
  int steps_;
  int passes_;  // per step
  RowPools pools_;
  JointSolver* joints_ = nullptr;
  btContactSolverInfo info_;
  btScalar step_ = 0;    // s
  btScalar forced_ = 0;  // the fraction of the tick's forces applied so far
  // Of soft contacts.
  btScalar push_rate_ = 0;  // 1/s: velocity by overlap
  btScalar mass_share_ = 1;
  btScalar impulse_share_ = 0;
  std::vector<Motion> motions_;
  std::vector<Contact> contacts_;
  std::vector<Friction> frictions_;
};

}  // namespace tessera::bullet
