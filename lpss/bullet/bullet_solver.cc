#include "lpss/bullet/bullet_solver.h"

#include "lpss/bullet/task_parts.h"

namespace tessera::bullet {

void BulletSolver::solve(const SolveTask& task, double dt) {
  if (settings_.substeps == 1 || !settings_.adapt) return run(task, dt);
  for (const TaskPart& part : parts_of(task, settings_.substeps, dt)) {
    solver_.take_substep_solver(part.steps);
    run(part.task, dt);
  }
}

void BulletSolver::run(const SolveTask& task, double dt) {
  if (task.bodies.empty()) return;
  solver_.set_up(task, dt);
  for (int n = 0; n < solver_.passes(); ++n) solver_.pass(n);
  solver_.finish();
}

}  // namespace tessera::bullet
