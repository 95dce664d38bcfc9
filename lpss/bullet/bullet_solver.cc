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
  if (settings_.substeps == 1) return run(whole_, task, dt);
  if (!settings_.adapt && task.joints.empty()) return run(small_, task, dt);
  for (const TaskPart& part : parts_of(task, settings_)) {
    if (!part.has_joints) small_.take_small_steps(part.steps);
    run(part.has_joints ? whole_ : small_, part.task, dt);
  }
}

}  // namespace tessera::bullet
