#include "lpss/bullet/bullet_solver.h"

#include "lpss/bullet/task_parts.h"

namespace tessera::bullet {
namespace {

void run(TaskSolver& solver, const SolveTask& task, double dt) {
  if (task.bodies.empty()) return;
  solver.set_up(task, dt);
  solver.solve();
  solver.finish();
}

}  // namespace

void BulletSolver::solve(const SolveTask& task, double dt) {
  if (!takes_small_steps_ || task.joints.empty()) return run(small_, task, dt);
  const TaskParts parts = parts_of(task);
  run(whole_, parts.jointed, dt);
  run(small_, parts.loose, dt);
}

}  // namespace tessera::bullet
