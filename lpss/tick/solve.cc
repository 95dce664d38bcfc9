#include "lpss/tick/solve.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <utility>

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

std::size_t JobQueue::add(std::vector<SolveJob> jobs) {
  const std::size_t first = jobs_.size();
  const auto begin = static_cast<std::ptrdiff_t>(order_.size());
  for (SolveJob& job : jobs) {
    weight_ += job.weight();
    order_.push_back(&jobs_.emplace_back(Job{std::move(job), {}}));
  }
  // Largest first, so that no thread ends alone.
  std::stable_sort(order_.begin() + begin, order_.end(),
                   [](const Job* a, const Job* b) { return a->job.weight() > b->job.weight(); });
  return first;
}

void JobQueue::run(double share) {
  const double enough = share * static_cast<double>(weight_);
  std::size_t end = next_;
  for (double sum = 0; end < order_.size() && (share >= 1 || sum < enough); ++end)
    sum += static_cast<double>(order_[end]->job.weight());
  run_parallel(parallel_, end - next_, [&](std::size_t n) {
    auto& [job, solved] = *order_[next_ + n];
    std::unique_ptr<IslandSolver> solver = solvers_.take();
    solver->solve(job.task, dt_, solved, parallel_);
    solvers_.put_back(std::move(solver));
    if (solved.blamed.empty()) return;
    const std::lock_guard lock(mutex_);
    for (const auto& [body, joint] : solved.blamed) blamed_[job.bodies[body]] = job.task.joints[joint].id;
  });
  next_ = end;
}

const JointLoads& JobQueue::loads(std::size_t job, JointId id) const {
  static const JointLoads kNone;
  const auto& [solved_job, solved] = jobs_[job];
  if (solved.joint_loads.empty()) return kNone;
  const std::vector<IslandJoint>& joints = solved_job.task.joints;
  return solved.joint_loads[static_cast<std::size_t>(
      std::ranges::lower_bound(joints, id, {}, &IslandJoint::id) - joints.begin())];
}

ShippedIslands::ShippedIslands(IslandPlan& plan, const std::vector<Shipment>& inbox, JobQueue& queue)
    : servers_(inbox.size()), queue_(queue) {
  absl::flat_hash_map<BodyId, std::vector<std::pair<Rank, const ShippedIsland*>>> shipped;
  for (Rank rank = 0; rank < inbox.size(); ++rank) {
    for (const ShippedIsland& island : inbox[rank].islands) shipped[island.island].push_back({rank, &island});
  }
  std::vector<SolveJob> jobs;
  for (PendingIsland& pending : plan.pending) {
    std::size_t bodies = 0;
    std::size_t pairs = 0;
    for (const auto& [rank, island] : shipped[pending.id]) {
      for (std::size_t n = 0; n < island->bodies.size(); ++n) pending.builder.add_body(*island, n);
      for (std::size_t n = 0; n < island->pairs.size(); ++n) pending.builder.add_pair(*island, n);
      for (const JointRecord& joint : island->joints) pending.builder.add_joint(joint);
      bodies += island->bodies.size();
      pairs += island->pairs.size();
      parcels_.push_back({rank, island->island, jobs.size(), bodies, pairs, island});
    }
    pending.builder.end_island();
    jobs.push_back(pending.builder.build());
  }
  const std::size_t first = queue.add(std::move(jobs));
  for (Parcel& parcel : parcels_) parcel.job += first;
}

std::vector<Solution> ShippedIslands::solutions() const {
  const auto until = [](const std::string& bytes, std::span<const std::size_t> ends, std::size_t begin,
                        std::size_t end) {
    const std::size_t from = begin > 0 ? ends[begin - 1] : 0;
    return end > begin ? bytes.substr(from, ends[end - 1] - from) : std::string();
  };
  std::vector<Solution> outbox(servers_);
  for (std::size_t n = 0; n < parcels_.size(); ++n) {
    const Parcel& parcel = parcels_[n];
    const bool is_first = n == 0 || parcels_[n - 1].job != parcel.job;
    const SolvedTask& solved = queue_.solved(parcel.job);
    outbox[parcel.from].islands.push_back(
        {parcel.island,
         until(solved.bodies, solved.body_ends, is_first ? 0 : parcels_[n - 1].bodies_end, parcel.bodies_end),
         until(solved.pairs, solved.pair_ends, is_first ? 0 : parcels_[n - 1].pairs_end, parcel.pairs_end)});
    for (const JointRecord& joint : parcel.shipped->joints)
      outbox[parcel.from].joint_loads.emplace_back(joint.id, queue_.loads(parcel.job, joint.id));
  }
  for (const auto& [body, joint] : queue_.blamed()) {
    for (Solution& solution : outbox) {
      if (!solution.islands.empty()) solution.blamed.push_back({body, joint});
    }
  }
  return outbox;
}

}  // namespace tessera
