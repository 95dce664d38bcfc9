#include "lpss/simulation/partition_cluster.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>

#include "lpss/engine/load_engine.h"
#include "lpss/observe/state.h"
#include "lpss/partition/bodies.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

constexpr std::uint64_t kFirstEpoch = 1;

// The curve cut so that each partition gets about as many bodies that can move.
SectorMap first_map(const WorldDescription& world, std::span<const BodyRecord> records,
                    std::uint32_t partitions) {
  absl::flat_hash_map<SectorIndex, double> weights;
  for (const BodyRecord& record : records) {
    if (record.properties.motion != Motion::kStatic) weights[record.home] += 1;
  }
  return SectorMap::balanced(world.anchor, {weights.begin(), weights.end()}, partitions, kFirstEpoch);
}

}  // namespace

absl::StatusOr<std::unique_ptr<PartitionCluster>> PartitionCluster::create(const WorldDescription& world,
                                                                           std::uint32_t partitions,
                                                                           int threads, bool free_flight) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  if (absl::Status status = check_programs(world); !status.ok()) return status;
  const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
  if (!joints.ok()) return joints.status();
  if (absl::Status status = open_grounds(world.shapes); !status.ok()) return status;
  PartitionOptions options{.settings = world.settings,
                           .anchor = world.anchor,
                           .map = first_map(world, *records, partitions),
                           .free_flight = free_flight};
  std::unique_ptr<PartitionCluster> cluster(new PartitionCluster());
  for (options.self = 0; options.self < partitions; ++options.self) {
    absl::StatusOr<Member*> member = cluster->add_member(options);
    if (!member.ok()) return member.status();
    Partition& partition = *(*member)->partition;
    add_world(partition, world, *records, *joints);
    (*member)->machine =
        std::make_unique<TickMachine>(partition, TickMachine::Options{.parallel = parallel_on(threads)});
  }
  return cluster;
}

absl::StatusOr<std::unique_ptr<PartitionCluster>> PartitionCluster::restore(const WorldSnapshot& world,
                                                                            std::uint32_t partitions,
                                                                            int threads) {
  if (absl::Status status = validate(world); !status.ok()) return status;
  PartitionOptions options{.settings = world.settings,
                           .anchor = world.anchor,
                           .map = SectorMap::balanced(world.anchor, load_of(world), partitions, kFirstEpoch)};
  std::unique_ptr<PartitionCluster> cluster(new PartitionCluster());
  cluster->tick_ = world.tick;
  for (options.self = 0; options.self < partitions; ++options.self) {
    absl::StatusOr<Member*> member = cluster->add_member(options);
    if (!member.ok()) return member.status();
    Partition& partition = *(*member)->partition;
    if (absl::Status status = resume(partition, world); !status.ok()) return status;
    (*member)->machine = std::make_unique<TickMachine>(
        partition, TickMachine::Options{.parallel = parallel_on(threads), .tick = world.tick});
  }
  return cluster;
}

absl::StatusOr<PartitionCluster::Member*> PartitionCluster::add_member(const PartitionOptions& options) {
  absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(engine_settings(options.settings));
  if (!engine.ok()) return engine.status();
  if (absl::Status status = can_run(options.settings.modules); !status.ok()) return status;
  Member& member = members_.emplace_back();
  member.engine = std::move(*engine);
  member.partition = std::make_unique<Partition>(options, *member.engine);
  return &member;
}

WorldSnapshot PartitionCluster::snapshot() const {
  const Partition& first = *members_.front().partition;
  WorldSnapshot world{.settings = first.settings,
                      .anchor = first.anchor,
                      .tick = tick_,
                      .shapes = shapes_of(first),
                      .shared = shared_state(first)};
  for (const Member& member : members_) {
    for (MovedSector& sector : pack_sectors(*member.partition)) world.sectors.push_back(std::move(sector));
  }
  std::sort(world.sectors.begin(), world.sectors.end(),
            [](const MovedSector& a, const MovedSector& b) { return a.sector < b.sector; });
  return world;
}

void PartitionCluster::add_shape(ShapeId id, const ShapeRef& shape) {
  for (Member& member : members_) tessera::add_shape(*member.partition, id, shape);
}

void PartitionCluster::add_module(const std::shared_ptr<const ProgramModule>& module) {
  for (Member& member : members_) tessera::add_module(*member.partition, module);
}

// Lets every partition go on as soon as it has heard whom it waits for.
void PartitionCluster::step(std::span<const Command> commands) {
  ++tick_;
  using Inbox = std::map<Rank, RoundMessage>;
  std::vector<std::optional<Round>> rounds(members_.size());
  std::vector<std::map<std::uint32_t, Inbox>> inboxes(
      members_.size());  // by receiver and number of the round
  const auto post = [&](Rank from) {
    if (!rounds[from]) return;
    ++rounds_;
    for (Rank to = 0; to < members_.size(); ++to) {
      std::optional<RoundMessage>& message = rounds[from]->to[to];
      if (!message) continue;
      if (listener_ && to != from) listener_(from, to, *message);
      inboxes[to][rounds[from]->number].insert_or_assign(from, *std::move(message));
    }
    members_[from].machine->work_while_waiting();
  };
  for (Rank rank = 0; rank < members_.size(); ++rank) {
    rounds[rank] = members_[rank].machine->begin_tick(commands);
    post(rank);
  }
  for (bool moved = true; moved;) {
    moved = false;
    for (Rank rank = 0; rank < members_.size(); ++rank) {
      if (!rounds[rank]) continue;
      Inbox& inbox = inboxes[rank][rounds[rank]->number];
      bool complete = true;
      for (Rank from = 0; complete && from < members_.size(); ++from)
        complete = !rounds[rank]->from[from] || inbox.contains(from);
      if (!complete) continue;
      std::vector<std::optional<RoundMessage>> messages(members_.size());
      for (auto& [from, message] : inbox) messages[from] = std::move(message);
      inbox.clear();
      rounds[rank] = members_[rank].machine->advance(std::move(messages));
      post(rank);
      moved = true;
    }
  }
}

WorldHash PartitionCluster::program_hash() const {
  WorldHash sum;
  for (const Member& member : members_) sum.add(program_hash_of(*member.partition));
  return sum;
}

WorldHash PartitionCluster::hash() const {
  WorldHash sum;
  for (const Member& member : members_) sum.add(hash_of(*member.partition));
  return sum;
}

TickCounts PartitionCluster::counts() const {
  TickCounts sum;
  for (const Member& member : members_) sum += member.machine->counts();
  return sum;
}

std::vector<Divergence> PartitionCluster::divergences() const {
  std::vector<Divergence> all;
  for (const Member& member : members_) {
    const std::vector<Divergence>& some = member.machine->divergences();
    all.insert(all.end(), some.begin(), some.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

absl::StatusOr<BodyRecord> PartitionCluster::body(BodyId id) const {
  for (const Member& member : members_) {
    if (const std::optional<BodyRecord> record = body_of(*member.partition, id)) return *record;
  }
  return absl::NotFoundError(absl::StrCat("no moving body with the id ", id.value));
}

}  // namespace tessera
