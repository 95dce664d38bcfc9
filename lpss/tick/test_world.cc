#include "lpss/tick/test_world.h"

#include "lpss/partition/joints.h"
#include "lpss/tick/cloning.h"
#include "lpss/tick/components.h"
#include "lpss/tick/detect.h"
#include "lpss/tick/exchange.h"
#include "lpss/tick/islands.h"
#include "lpss/tick/seam_search.h"
#include "lpss/tick/ship.h"
#include "lpss/tick/solve.h"

namespace tessera {

TestWorld::TestWorld(std::uint32_t servers, const WorldSettings& settings) {
  for (Rank rank = 0; rank < servers; ++rank) partitions_.emplace_back(settings, servers, rank);
  contexts.resize(servers);
  for (TickContext& context : contexts) context.tick = 1;
}

void TestWorld::add(const BodyRecord& record) {
  for (TestPartition& partition : partitions_) add_body(*partition, record);
}

void TestWorld::add(const JointRecord& record, const std::vector<JointTie>& leaders) {
  for (TestPartition& partition : partitions_) add_joint(*partition, record, leaders);
}

Partition& TestWorld::host(const SectorIndex& index) {
  return *partitions_[partitions_[0]->map.owner(index)];
}

BodyState TestWorld::state(std::uint64_t id) {
  Rank rank = 0;
  while (!partitions_[rank]->bodies.contains(BodyId{id})) ++rank;
  return state_of(*partitions_[rank], id);
}

void TestWorld::exchange() {
  std::vector<std::vector<Exchange>> outboxes(servers(), std::vector<Exchange>(servers()));
  for (Rank rank = 0; rank < servers(); ++rank) {
    attend_borders(*partitions_[rank]);
    search_seams(*partitions_[rank]);
    tell_of_replicas(*partitions_[rank], outboxes[rank]);
  }
  for (Rank rank = 0; rank < servers(); ++rank) {
    std::vector<Exchange> inbox = received(outboxes, rank);
    take_replicas(*partitions_[rank], inbox);
    list_far_clones(*partitions_[rank]);
    update_clones(*partitions_[rank], {});
  }
}

void TestWorld::detect() {
  for (Rank rank = 0; rank < servers(); ++rank) {
    contexts[rank].stepped = tessera::detect(*partitions_[rank], {});
  }
}

void TestWorld::connect() {
  seams.clear();
  for (Rank rank = 0; rank < servers(); ++rank) {
    seams.push_back(find_components(*partitions_[rank], {}, contexts[rank].vacated));
  }
}

void TestWorld::plan() {
  std::vector<const Seams*> said;
  for (const Seams& message : seams) said.push_back(&message);
  shipments.clear();
  for (Rank rank = 0; rank < servers(); ++rank) {
    const std::vector<SectorIndex> awake = take_parts(*partitions_[rank], said);
    shipments.push_back(plan_islands(*partitions_[rank], contexts[rank], awake, {}));
  }
}

void TestWorld::solve() {
  solutions.clear();
  const ParallelFor alone;
  for (Rank rank = 0; rank < servers(); ++rank) {
    Partition& partition = *partitions_[rank];
    IslandPlan& islands = contexts[rank].plan;
    const std::vector<Shipment> inbox = received(shipments, rank);
    SolverPool solvers(partition.engine);
    JobQueue queue(partition.dt(), alone, solvers);
    const ShippedIslands shipped(islands, inbox, queue);
    queue.add(std::move(islands.jobs));
    queue.finish();
    solutions.push_back(shipped.solutions());
  }
  for (Rank rank = 0; rank < servers(); ++rank) {
    for (const Solution& solution : received(solutions, rank)) take_solution(contexts[rank].plan, solution);
  }
}

JointRecord hinge(std::uint64_t id, std::uint64_t parent, std::uint64_t child) {
  JointRecord record;
  record.id = JointId{id};
  record.properties.type = JointType::kRevolute;
  record.properties.parent = BodyId{parent};
  record.properties.child = BodyId{child};
  record.properties.in_parent.position = {0.5, 0, 0};
  record.properties.in_child.position = {-0.5, 0, 0};
  record.parent_motion = Motion::kDynamic;
  return record;
}

}  // namespace tessera
