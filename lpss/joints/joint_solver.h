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

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "lpss/base/disjoint_sets.h"
#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

// One task at a time: clear(), add(), set_up(), then for each substep start_step(), passes with a move()
// among them, and end_step(); or passes alone, if a tick is one step.
class JointSolver {
 public:
  void clear();
  bool is_empty() const { return joints_.empty(); }

  void add(const SolvedJoint& joint) {
    joints_.push_back(joint);
    joints_.back().place = joints_.size() - 1;
  }

  // The bodies of the joints, ascending. Valid until the next call.
  std::span<const std::size_t> bodies();

  // For a tick of `dt` seconds in so many steps, which share the bounds of impulses. Of the bodies, those of
  // joints are looked at.
  void set_up(std::span<const JointedBody> bodies, double dt, int steps);

  // After set_up(): where a body is.
  struct Place {
    JointAssembly* assembly;
    Eigen::Index body;
  };
  Place place_of(std::size_t body) { return {&assembly_of(body), places_[body]}; }

  // All of these are those of JointAssembly.
  void start_step();
  void pass();
  // Of assemblies of which others have pushed a body since.
  void pass_if_pushed();
  // Of those that contacts do not touch.
  void pass_untouched();

  void move();
  void end_step();

  // Ends the tick. How bodies have come to move; valid until the next call.
  std::span<const BodyMotion> end();

  // Then: JointAssembly::write_impulses(), of all joints in the order in which they were added.
  void write_impulses(std::span<JointLoads> impulses) const;

 private:
  JointAssembly& assembly_of(std::size_t body);
  std::span<const std::unique_ptr<JointAssembly>> assemblies() const { return {assemblies_.data(), count_}; }

  std::vector<SolvedJoint> joints_;
  KnownPatterns patterns_;
  std::vector<std::unique_ptr<JointAssembly>> assemblies_;  // kept from tick to tick for their storage
  std::size_t count_ = 0;                                   // of assemblies in this tick
  std::vector<std::size_t> bodies_;
  std::vector<BodyMotion> moved_;
  DisjointSets sets_;
  std::vector<std::size_t> assembly_of_;  // by the first body of each
  std::vector<Eigen::Index> places_;      // of bodies, in their assemblies
};

}  // namespace tessera::joints
