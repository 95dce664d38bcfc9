// The engine's solvers: arrays of islands, out of sectors' worlds to lpss/islands and back.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/islands/contact_needs.h"
#include "lpss/islands/island_steps.h"
#include "lpss/islands/step_solver.h"
#include "lpss/native/task_arrays.h"

namespace tessera::native {

class NativeSolver final : public IslandSolver, public StagedSolver {
 public:
  NativeSolver(const EngineSettings& settings, const ContactNeeds& needs);

  void solve(const SolveTask& task, double dt, SolvedTask& solved, const ParallelFor& parallel) override;

  int begin(const SolveTask& task, double dt, const Stages& stages) override;
  void solve_stage(int sweep, std::size_t stage) override { solver_.solve_stage(sweep, stage); }
  void end() override;
  std::size_t motion_size(int sweep) const override { return solver_.motion_size(sweep); }
  void append_motion(int sweep, std::size_t body, std::string& bytes) const override {
    solver_.append_motion(sweep, body, bytes);
  }
  void set_motion(int sweep, std::size_t body, std::string_view bytes) override;

 private:
  void blame(SolvedTask& solved) const;

  const ContactNeeds& needs_;
  TaskArrays arrays_;
  StepSolver<Scalar> solver_;
  IslandSteps<Scalar> island_steps_;
  std::vector<int> steps_;             // by island
  std::vector<std::size_t> together_;  // islands that take the same number
};

}  // namespace tessera::native
