// Islands over any number of worlds, solved whole.
#pragma once

#include "lpss/bullet/task_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// Islands without joints in small steps, where the settings ask for them, as many as each needs. Those with
// joints in passes over the whole tick: their rows keep no impulses, and what takes back the errors of the
// last tick must not act again in each step.
class BulletSolver final : public IslandSolver {
 public:
  explicit BulletSolver(const EngineSettings& settings)
      : settings_(settings), whole_(without_small_steps(settings)), small_(settings) {}

  void solve(const SolveTask& task, double dt) override;

 private:
  EngineSettings settings_;
  TaskSolver whole_;
  TaskSolver small_;
};

}  // namespace tessera::bullet
