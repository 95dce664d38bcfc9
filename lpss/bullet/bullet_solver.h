// Solves whole islands over any number of worlds.
#pragma once

#include "lpss/bullet/small_step_solver.h"
#include "lpss/bullet/task_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// With substeps, if the settings specify them, as many as each island needs.
class BulletSolver final : public IslandSolver {
 public:
  explicit BulletSolver(const EngineSettings& settings)
      : settings_(settings), small_steps_(settings), one_step_(settings) {}

  void solve(const SolveTask& task, double dt) override;

 private:
  EngineSettings settings_;
  SmallStepSolver small_steps_;
  TaskSolver one_step_;
};

}  // namespace tessera::bullet
