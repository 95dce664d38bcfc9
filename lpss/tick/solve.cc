#include "lpss/tick/solve.h"

#include <algorithm>
#include <utility>

#include "lpss/base/disjoint_sets.h"

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

void JobQueue::add(std::vector<SolveJob> jobs) {
  DisjointSets sets(jobs.size());
  absl::flat_hash_map<std::pair<SectorWorld*, BodySlot>, std::size_t> user;
  for (std::size_t job = 0; job < jobs.size(); ++job) {
    for (const WorldBody& body : jobs[job].kinematics) {
      const auto [place, is_new] = user.try_emplace({body.world, body.slot}, job);
      if (!is_new) sets.unite(job, place->second);
    }
  }
  std::vector<Group> groups(jobs.size());
  for (std::size_t job = 0; job < jobs.size(); ++job) {
    Group& group = groups[sets.find(job)];
    group.weight += jobs[job].task.contacts.size() + jobs[job].task.bodies.size();
    group.jobs.push_back(std::move(jobs[job]));
  }
  std::erase_if(groups, [](const Group& group) { return group.jobs.empty(); });
  // Largest first, so that no thread ends alone.
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Group& a, const Group& b) { return a.weight > b.weight; });
  for (Group& group : groups) {
    weight_ += group.weight;
    groups_.push_back(std::move(group));
  }
}

void JobQueue::run(double share) {
  const double enough = share * static_cast<double>(weight_);
  std::size_t end = next_;
  for (double sum = 0; end < groups_.size() && (share >= 1 || sum < enough); ++end)
    sum += static_cast<double>(groups_[end].weight);
  run_parallel(parallel_, end - next_, [&](std::size_t n) {
    std::unique_ptr<IslandSolver> solver = solvers_.take();
    for (const SolveJob& job : groups_[next_ + n].jobs) {
      solver->solve(job.task, dt_, parallel_);
      if (job.joints.empty()) continue;
      BlamedJoints blamed;
      blame_joints(job, blamed);
      if (blamed.empty()) continue;
      const std::lock_guard lock(mutex_);
      blamed_.merge(blamed);
    }
    solvers_.put_back(std::move(solver));
  });
  next_ = end;
}

ShippedIslands::ShippedIslands(Partition& partition, IslandPlan& plan, const std::vector<Shipment>& inbox,
                               JobQueue& queue) {
  absl::flat_hash_map<BodyId, std::vector<const ShippedIsland*>> shipped;
  for (const Shipment& message : inbox) {
    for (const ShippedIsland& island : message.islands) shipped[island.island].push_back(&island);
  }
  std::vector<SolveJob> jobs;
  for (PendingIsland& pending : plan.pending) {
    std::vector<const ShippedBody*> bodies;
    std::vector<const ShippedContact*> contacts;
    std::vector<JointRecord>& joints = joints_.emplace_back();
    for (const ShippedIsland* island : shipped[pending.id]) {
      for (const ShippedBody& body : island->bodies) bodies.push_back(&body);
      for (const ShippedContact& contact : island->contacts) contacts.push_back(&contact);
      joints.insert(joints.end(), island->joints.begin(), island->joints.end());
    }
    carriers_.push_back(std::make_unique<Carriers>(partition.engine, partition.sector_size(), bodies,
                                                   std::move(contacts), pending.own, pending.builder));
    jobs.push_back(build_job(partition, pending.builder, joints));
  }
  queue.add(std::move(jobs));
}

std::vector<Solution> ShippedIslands::solutions(const SectorMap& map, const BlamedJoints& blamed) const {
  std::vector<Solution> outbox(map.servers());
  for (const std::unique_ptr<Carriers>& carried : carriers_) carried->collect(map, outbox);
  for (Solution& solution : outbox) {
    for (SolvedBody& solved : solution.bodies) {
      if (const auto joint = blamed.find(solved.id); joint != blamed.end()) solved.blamed = joint->second;
    }
  }
  return outbox;
}

}  // namespace tessera
