#include "lpss/tick/solve.h"

#include <algorithm>
#include <numeric>

#include "lpss/base/disjoint_sets.h"
#include "lpss/tick/ship.h"

namespace tessera {

std::unique_ptr<IslandSolver> SolverPool::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<IslandSolver> solver = std::move(idle_.back());
      idle_.pop_back();
      return solver;
    }
  }
  return engine_.make_solver();
}

void SolverPool::put_back(std::unique_ptr<IslandSolver> solver) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(solver));
}

namespace {

// Largest first; jobs that touch the same kinematic body one after the other, as engines keep solver state in
// it.
void run_jobs(const std::vector<SolveJob>& jobs, double dt, const ParallelFor& parallel,
              SolverPool& solvers) {
  DisjointSets sets(jobs.size());
  absl::flat_hash_map<std::pair<SectorWorld*, BodySlot>, std::size_t> user;
  for (std::size_t job = 0; job < jobs.size(); ++job) {
    for (const WorldBody& body : jobs[job].kinematics) {
      const auto [place, is_new] = user.try_emplace({body.world, body.slot}, job);
      if (!is_new) sets.unite(job, place->second);
    }
  }
  std::vector<std::vector<std::size_t>> groups(jobs.size());
  for (std::size_t job = 0; job < jobs.size(); ++job) groups[sets.find(job)].push_back(job);
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  const auto weight = [&](const std::vector<std::size_t>& group) {
    return std::accumulate(group.begin(), group.end(), std::size_t{0}, [&](std::size_t sum, std::size_t job) {
      return sum + jobs[job].task.contacts.size() + jobs[job].task.bodies.size();
    });
  };
  std::stable_sort(groups.begin(), groups.end(),
                   [&](const auto& a, const auto& b) { return weight(a) > weight(b); });
  run_parallel(parallel, groups.size(), [&](std::size_t g) {
    std::unique_ptr<IslandSolver> solver = solvers.take();
    for (const std::size_t job : groups[g]) solver->solve(jobs[job].task, dt);
    solvers.put_back(std::move(solver));
  });
}

}  // namespace

std::vector<Solution> solve(Partition& partition, IslandPlan& plan, const std::vector<Shipment>& inbox,
                            const ParallelFor& parallel, SolverPool& solvers) {
  absl::flat_hash_map<BodyId, std::vector<const ShippedIsland*>> shipped;
  for (const Shipment& message : inbox) {
    for (const ShippedIsland& island : message.islands) shipped[island.island].push_back(&island);
  }
  std::vector<std::unique_ptr<Carriers>> carriers;
  for (PendingIsland& pending : plan.pending) {
    carriers.push_back(std::make_unique<Carriers>(partition.engine, partition.sector_size(),
                                                  shipped[pending.id], pending.own, pending.builder));
    plan.jobs.push_back(build_job(partition, pending.builder));
  }
  run_jobs(plan.jobs, partition.dt(), parallel, solvers);
  std::vector<Solution> outbox(partition.map.servers());
  for (const std::unique_ptr<Carriers>& carried : carriers) carried->collect(partition.map, outbox);
  return outbox;
}

}  // namespace tessera
