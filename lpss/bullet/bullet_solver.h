// Solves whole islands over any number of worlds.
#pragma once

#include "lpss/bullet/task_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// With substeps, if the settings specify them, as many as each island needs.
class BulletSolver final : public IslandSolver {
 public:
  explicit BulletSolver(const EngineSettings& settings) : settings_(settings), solver_(settings) {}

  void solve(const SolveTask& task, double dt) override;

 private:
  void run(const SolveTask& task, double dt);

  EngineSettings settings_;
  TaskSolver solver_;
};

}  // namespace tessera::bullet
