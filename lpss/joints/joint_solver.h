// Solves the rows of the joints of one task, in double precision whatever the engine computes with.
//
// Joints hold exactly: the bodies that joints connect form an assembly, whose rows are
// solved at once by a sparse factorisation (Baraff, Linear-time dynamics using Lagrange multipliers, 1996;
// here with closed loops, too), so that they hold for the poses at the end of a step (Ryckaert,
// Ciccotti and Berendsen, Numerical integration of the cartesian equations of motion of a system with
// constraints, 1977). Springs, dampers and axes that follow others are rows of the same system. Limits,
// drives and friction act one after the other on the motions that are left free, with the inertia of all that
// they move.
//
// Errors of poses are corrected as poses: no velocity stays of it. Rows of a loop follow from each other, up
// to the rounding of poses, so a velocity that corrects an error can be of any size.
//
// An assembly moves substep by substep, with new rows in each: rows at the start of the tick predict the end
// of a fast motion badly, and so that of a taut one. One with many
// limits and drives does so only if it turns far.
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

// One task at a time: clear(), add(), set_up(), then for each substep start_step() and passes, with a
// move() among them; or passes alone, if a tick is one step.
class JointSolver {
 public:
  void clear();
  bool is_empty() const { return joints_.empty(); }

  void add(SolvedJoint joint) { joints_.push_back(std::move(joint)); }

  // The added bodies, possibly with duplicates.
  std::vector<int> bodies() const;

  // For a tick of `dt` seconds in so many steps, which share the bounds of impulses.
  void set_up(std::span<const JointedBody> bodies, double dt, int steps);

  // Limits, drives and friction act as they did at the end of the step before.
  void start_step();
  void pass();

  // The velocities are those that bodies move by in this step.
  void move();

  // Ends the tick. Those that have moved step by step.
  std::vector<BodyMotion> end();

 private:
  std::vector<SolvedJoint> joints_;
  KnownPatterns patterns_;
  std::vector<std::unique_ptr<JointAssembly>> assemblies_;
};

}  // namespace tessera::joints
