#include "lpss/bullet/bullet_solver.h"

namespace tessera::bullet {

void BulletSolver::solve(const SolveTask& task, double dt) {
  if (task.bodies.empty()) return;
  solver_.set_up(task, dt);
  for (int n = 0; n < solver_.passes(); ++n) solver_.pass(n);
  solver_.finish();
}

}  // namespace tessera::bullet
