// One part of an island, solved coupled with the others.
#pragma once

#include <vector>

#include "lpss/bullet/small_step_solver.h"
#include "lpss/bullet/task_solver.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// On a solver of whole tasks: SmallStepSolver or TaskSolver.
template <typename Solver>
class BulletPartSolver final : public PartSolver {
 public:
  explicit BulletPartSolver(const EngineSettings& settings) : solver_(settings) {}

  int passes() const override { return solver_.rounds(); }
  void begin(const SolveTask& task, std::span<const std::size_t> shared, double dt) override;
  void pass(int n) override;
  VelocityChange change(std::size_t n) const override;
  void agree(std::size_t n, const VelocityChange& change) override;
  void split(std::size_t n, double times) override;
  void end() override;

 private:
  // A body that other parts share, and its common change so far.
  struct Shared {
    std::size_t body;  // an index into the task's bodies
    VelocityChange agreed;
  };

  Solver solver_;
  bool is_empty_ = true;
  std::vector<Shared> shared_;
};

extern template class BulletPartSolver<SmallStepSolver>;
extern template class BulletPartSolver<TaskSolver>;

}  // namespace tessera::bullet
