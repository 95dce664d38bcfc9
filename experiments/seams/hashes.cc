#include "experiments/seams/hashes.h"

#include "cli/interrupt.h"
#include "lpss/simulation/partition_cluster.h"
#include "simulator/simulated_cluster.h"

namespace tessera::seams {
namespace {

constexpr std::uint32_t kServers = 3;
constexpr std::uint32_t kPartitionsShuffled = 4;
constexpr std::uint32_t kPartitionsMany = 10;

absl::StatusOr<std::string> hash_on_partitions(const WorldDescription& world, std::uint32_t partitions,
                                               Tick ticks) {
  const absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster =
      PartitionCluster::create(world, partitions);
  if (!cluster.ok()) return cluster.status();
  for (Tick tick = 0; tick < ticks; ++tick) {
    if (cli::interrupted()) return absl::CancelledError("interrupted");
    (*cluster)->step();
  }
  return (*cluster)->hash().to_string();
}

absl::StatusOr<std::string> hash_on_network(const WorldDescription& world, std::uint64_t seed, Tick ticks) {
  SimulatedCluster cluster(seed, kServers, world.settings.precision);
  cluster.end_when(cli::interrupted);
  if (absl::Status loaded = cluster.load(world); !loaded.ok()) return loaded;
  if (absl::Status stepped = cluster.step(ticks); !stepped.ok()) return stepped;
  const absl::StatusOr<SimulatedCluster::HashAt> hash = cluster.hash();
  if (!hash.ok()) return hash.status();
  return hash->hash;
}

}  // namespace

absl::StatusOr<Equality> compare_hashes(const Scene& scene, Policy policy, Precision precision,
                                        const HashOptions& options) {
  const absl::StatusOr<Stage> stage = seams::stage(scene, Placement::kCorner, policy, precision);
  if (!stage.ok()) return stage.status();
  WorldDescription world = stage->world;
  Equality equality;
  equality.scene = scene.name;
  equality.policy = policy;
  equality.ticks = scene.heavy ? options.ticks_heavy : options.ticks;
  const absl::StatusOr<std::string> alone = hash_on_partitions(world, 1, equality.ticks);
  if (!alone.ok()) return alone.status();
  equality.world_hash = *alone;
  const absl::StatusOr<std::string> many = hash_on_partitions(world, kPartitionsMany, equality.ticks);
  if (!many.ok()) return many.status();
  equality.ten_partitions_equal = *many == *alone;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    const absl::StatusOr<std::string> hash =
        hash_on_network(world, static_cast<std::uint64_t>(seed), equality.ticks);
    if (!hash.ok()) return hash.status();
    ++equality.seeds;
    equality.seeds_equal += *hash == *alone ? 1 : 0;
  }
  for (int seed = 1; seed <= options.shuffles; ++seed) {
    world.settings.shuffle = static_cast<std::uint64_t>(seed);
    const absl::StatusOr<std::string> hash = hash_on_partitions(world, kPartitionsShuffled, equality.ticks);
    if (!hash.ok()) return hash.status();
    ++equality.shuffles;
    equality.shuffles_equal += *hash == *alone ? 1 : 0;
  }
  return equality;
}

}  // namespace tessera::seams
