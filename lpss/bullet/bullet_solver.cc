#include "lpss/bullet/bullet_solver.h"

namespace tessera::bullet {

void BulletSolver::solve(const SolveTask& task, double dt) {
  if (task.bodies.empty()) return;
  solver_.set_up(task, dt);
  solver_.solve();
  solver_.finish();
}

}  // namespace tessera::bullet
