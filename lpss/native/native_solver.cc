#include "lpss/native/native_solver.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "lpss/engine/require.h"

namespace tessera::native {

NativeSolver::NativeSolver(const EngineSettings& settings, const ContactNeeds& needs)
    : needs_(needs),
      arrays_(settings, needs),
      solver_({.steps = settings.substeps,
               .iterations = settings.solver_iterations,
               .bounce_from = settings.bounce_from}) {}

void NativeSolver::solve(const SolveTask& task, double dt, SolvedTask& solved, const ParallelFor& parallel) {
  std::vector<JointLoads> loads = std::move(solved.joint_loads);  // for its storage
  loads.clear();
  solved.clear();
  solved.joint_loads = std::move(loads);
  if (task.bodies.empty()) return;
  arrays_.make_room(task, solved);
  arrays_.gather_joints(task, dt, parallel);
  const std::span<const int> steps = island_steps_.of(task.islands, arrays_.islands(), needs_, dt);
  steps_.assign(steps.begin(), steps.end());
  constexpr int kDone = 0;
  for (std::size_t first = 0; first < steps_.size(); ++first) {
    const int number = steps_[first];
    if (number == kDone) continue;
    together_.clear();
    for (std::size_t n = first; n < steps_.size(); ++n) {
      if (steps_[n] != number) continue;
      together_.push_back(n);
      steps_[n] = kDone;
    }
    arrays_.gather(task, together_, dt, number, parallel);
    solver_.solve(arrays_.islands(), dt, number, parallel);
    arrays_.put_back(&solved, parallel);
    blame(solved);
  }
}

void NativeSolver::blame(SolvedTask& solved) const {
  for (const auto& [body, joint] : solver_.blamed())
    solved.blamed.push_back({arrays_.body_in_task(body), arrays_.joint_in_task(joint)});
}

int NativeSolver::begin(const SolveTask& task, double dt, const Stages& stages) {
  static const ParallelFor kOneThread;
  together_.resize(task.islands.size());
  std::iota(together_.begin(), together_.end(), std::size_t{0});
  arrays_.gather(task, together_, dt, stages.substeps, kOneThread);
  return solver_.begin(arrays_.islands(), dt, stages.substeps, stages.ends, stages.bounces, kOneThread);
}

void NativeSolver::end() {
  solver_.end();
  arrays_.put_back(nullptr, {});
}

void NativeSolver::set_motion(int sweep, std::size_t body, std::string_view bytes) {
  require(solver_.set_motion(sweep, body, bytes), "a motion must come from an engine of the same precision");
}

}  // namespace tessera::native
