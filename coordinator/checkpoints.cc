#include "coordinator/checkpoints.h"

#include <algorithm>
#include <iterator>

#include "proto/wire.h"

namespace tessera {
namespace {

absl::StatusOr<WorldSnapshot> read(const Checkpoint& checkpoint) {
  WorldSnapshot world;
  world.tick = checkpoint.tick;
  for (const v1::SnapshotChunk& chunk : checkpoint.chunks) {
    if (chunk.has_shared()) {
      absl::StatusOr<SharedState> shared = unpack_shared(chunk.shared());
      if (!shared.ok()) return shared.status();
      world.shared = *std::move(shared);
    } else {
      absl::StatusOr<std::vector<MovedSector>> sectors = unpack_sectors(chunk.sectors());
      if (!sectors.ok()) return sectors.status();
      std::move(sectors->begin(), sectors->end(), std::back_inserter(world.sectors));
    }
  }
  std::sort(world.sectors.begin(), world.sectors.end(),
            [](const MovedSector& a, const MovedSector& b) { return a.sector < b.sector; });
  return world;
}

}  // namespace

void Checkpoints::add(Checkpoint checkpoint, Nanoseconds now) {
  later_.push_back({std::move(checkpoint), now});
  settle(now);
}

void Checkpoints::settle(Nanoseconds now) {
  if (start_ && !later_.empty() && later_.front().time + kStreamSlack <= now) start_.reset();
  while (!start_ && later_.size() > 1 && later_[1].time + kStreamSlack <= now) later_.pop_front();
}

absl::StatusOr<Placement> Checkpoints::place_earliest(std::uint64_t number, const WorldSettings& settings,
                                                      const SectorIndex& anchor,
                                                      std::vector<ShapeEntry> shapes,
                                                      std::span<const NodeId> nodes, std::uint64_t map_epoch,
                                                      BalancePolicy policy) const {
  if (start_) return place(number, *start_, nodes, map_epoch, policy);
  const Checkpoint& checkpoint = later_.front().checkpoint;
  absl::StatusOr<WorldSnapshot> world = read(checkpoint);
  if (!world.ok()) return world.status();
  world->settings = settings;
  world->anchor = anchor;
  world->shapes = std::move(shapes);
  return place(number, WorldToLoad{ReadSnapshot{*std::move(world), {}}}, nodes, map_epoch, policy);
}

}  // namespace tessera
