// Bullet's own sequential impulses over whole islands, for the policy clone and for comparison.
#pragma once

#include "lpss/bullet/task_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

class BulletSolver final : public IslandSolver {
 public:
  explicit BulletSolver(const EngineSettings& settings) : solver_(settings) {}

  void solve(const SolveTask& task, double dt, SolvedTask& solved, const ParallelFor& /*parallel*/) override {
    solved.clear();
    if (!task.bodies.empty()) solver_.solve(task, dt);
  }

 private:
  TaskSolver solver_;
};

}  // namespace tessera::bullet
