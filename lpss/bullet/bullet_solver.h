// Islands over any number of worlds, solved whole.
#pragma once

#include "lpss/bullet/task_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

class BulletSolver final : public IslandSolver {
 public:
  explicit BulletSolver(const EngineSettings& settings) : solver_(settings) {}

  void solve(const SolveTask& task, double dt) override;

 private:
  TaskSolver solver_;
};

}  // namespace tessera::bullet
