// Solves islands in small steps: their contacts by lpss/solver/contact_solver.h, their joints by
// lpss/joints/joint_solver.h, in turns. A sweep is a pass of a step over all contacts; after those of all
// steps, kRebounds more let bodies bounce.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lpss/base/parallel.h"
#include "lpss/islands/islands.h"
#include "lpss/islands/joint_turns.h"
#include "lpss/solver/contact_solver.h"

namespace tessera {

// The usual steps of a tick, and what all of them have in common.
struct StepOptions {
  int steps = 4;           // of a tick, >= 1, for contacts that are as stiff as usual
  int iterations = 10;     // of a tick, shared out among these
  double bounce_from = 0;  // as ContactSolver::Options
};

// How deep overlaps are taken to be at most: they are opened as if they were no deeper, so that bodies that
// start inside each other come apart slowly.
template <typename Scalar>
class Opening {
 public:
  // For ticks of `dt` seconds in so many steps, where `usual_steps` are usual.
  Opening(double dt, int usual_steps, int steps);

  // m, < 0: of a contact whose bodies have such an extent (m) and nimbleness (ContactScale).
  Scalar deepest_gap(Scalar extent, Scalar nimbleness) const;

 private:
  Scalar in_steps_;
  Scalar stiffer_;
};

// One set of islands at a time: solve(); or begin(), the stages of all sweeps, and end().
template <typename Scalar>
class StepSolver {
 public:
  explicit StepSolver(const StepOptions& options);

  // Their impulses, and `solved`, for a tick of `dt` seconds in so many steps.
  void solve(Islands<Scalar>& islands, double dt, int steps, const ParallelFor& parallel);

  // Contacts are divided into stages, in the order of solving: each ends after so many. With `bounces`, a
  // contact of these islands, here or elsewhere, may give speed back. Returns the number of sweeps. The
  // islands stay as they are until end(); there are no joints.
  int begin(Islands<Scalar>& islands, double dt, int steps, std::span<const std::size_t> stage_ends,
            bool bounces, const ParallelFor& parallel);
  void solve_stage(int sweep, std::size_t stage);
  void end();

  // What solvers elsewhere must know of a body before a stage of a sweep in which they have it, and the size
  // of that in bytes. set_motion() is false for bytes of another size.
  std::size_t motion_size(int sweep) const;
  void append_motion(int sweep, std::size_t body, std::string& bytes) const;
  [[nodiscard]] bool set_motion(int sweep, std::size_t body, std::string_view bytes);

  // Who has diverged among the bodies of joints, after end().
  std::span<const BlamedJoint> blamed() const { return blamed_; }

 private:
  using Contacts = ContactSolver<Scalar>;

  bool may_bounce() const { return contacts_.may_bounce() || joints_.may_bounce(); }
  void rebound(int sweep, std::size_t stage);
  bool needs_advance(int sweep) const;
  bool is_relaxed(int sweep) const { return sweep < steps_ * passes_ && sweep % passes_ == passes_ - 1; }
  void find_pushed();

  const StepOptions options_;
  const int passes_;  // of a step, biased and relaxed
  int steps_ = 0;
  std::size_t stages_ = 0;
  // From begin() to end().
  Islands<Scalar>* islands_ = nullptr;
  const ParallelFor* parallel_ = nullptr;
  Contacts contacts_;
  JointTurns<Scalar> joints_;
  std::vector<std::size_t> stage_ends_;  // in patches
  std::vector<BlamedJoint> blamed_;
};

extern template class Opening<float>;
extern template class Opening<double>;
extern template class StepSolver<float>;
extern template class StepSolver<double>;

}  // namespace tessera
