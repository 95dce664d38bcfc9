#include "lpss/bullet/bullet_solver.h"

#include "lpss/bullet/task_parts.h"

namespace tessera::bullet {
namespace {

template <typename Solver>
void run(Solver& solver) {
  for (int n = 0; n < solver.rounds(); ++n) solver.round(n);
  solver.finish();
}

}  // namespace

void BulletSolver::solve(const SolveTask& task, double dt) {
  if (task.bodies.empty()) return;
  if (settings_.substeps == 1) {
    one_step_.set_up(task, dt);
    run(one_step_);
  } else if (settings_.adapt) {
    for (const TaskPart& part : parts_of(task, settings_.substeps, dt)) {
      small_steps_.set_up(part.task, dt, part.steps);
      run(small_steps_);
    }
  } else {
    small_steps_.set_up(task, dt);
    run(small_steps_);
  }
}

}  // namespace tessera::bullet
