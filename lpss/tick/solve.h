// Solving: the islands of this server become new velocities, on all its threads.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "lpss/tick/context.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Solvers for as many threads as want one.
class SolverPool {
 public:
  explicit SolverPool(Engine& engine) : engine_(engine) {}

  std::unique_ptr<IslandSolver> take();
  void put_back(std::unique_ptr<IslandSolver> solver);

 private:
  Engine& engine_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<IslandSolver>> idle_;
};

// Solves what is planned, with the parts that other servers shipped. Returns what goes back to them, by rank.
std::vector<Solution> solve(Partition& partition, IslandPlan& plan, const std::vector<Shipment>& inbox,
                            const ParallelFor& parallel, SolverPool& solvers);

}  // namespace tessera
