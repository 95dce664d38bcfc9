#include "lpss/bullet/bullet_part_solver.h"

namespace tessera::bullet {

template <typename Solver>
void BulletPartSolver<Solver>::begin(const SolveTask& task, std::span<const std::size_t> shared, double dt) {
  is_empty_ = task.bodies.empty();
  shared_.clear();
  if (is_empty_) return;
  for (std::size_t body : shared) shared_.push_back({body, {}});
  solver_.set_up(task, dt);
}

template <typename Solver>
void BulletPartSolver<Solver>::pass(int n) {
  if (!is_empty_) solver_.round(n);
}

template <typename Solver>
VelocityChange BulletPartSolver<Solver>::change(std::size_t n) const {
  VelocityChange change = solver_.change(shared_[n].body);
  change += scaled(shared_[n].agreed, -1);
  return change;
}

// All copies are rounded in the same way, and keep the rounding error.
template <typename Solver>
void BulletPartSolver<Solver>::agree(std::size_t n, const VelocityChange& change) {
  Shared& shared = shared_[n];
  shared.agreed += change;
  solver_.set_change(shared.body, shared.agreed);
  shared.agreed = solver_.change(shared.body);
}

template <typename Solver>
void BulletPartSolver<Solver>::split(std::size_t n, double times) {
  solver_.split(shared_[n].body, times);
}

template <typename Solver>
void BulletPartSolver<Solver>::end() {
  if (!is_empty_) solver_.finish();
}

template class BulletPartSolver<SmallStepSolver>;
template class BulletPartSolver<TaskSolver>;

}  // namespace tessera::bullet
