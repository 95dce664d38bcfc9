#include "lpss/observe/load.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>

namespace tessera {
namespace {

// In units of one awake body's.
constexpr double kWorkOfSector = 4;  // that the tick looks at
constexpr double kWorkOfPair = 2;

// Of more sectors than this, those at rest are counted by a sample.
constexpr std::size_t kCountedMax = 16'384;

using LoadBySector = absl::flat_hash_map<SectorIndex, LoadPiece>;

// The sector in which the body will be in `ahead` seconds; its own where that is none of the world's.
SectorIndex sector_ahead(const Partition& partition, const HomeBody& body, double ahead) {
  const SectorWorld& world = *body.sector->world;
  const absl::StatusOr<WorldPosition> position =
      canonical(body.sector->index, world.position(body.slot) + world.linear_velocity(body.slot) * ahead,
                partition.sector_size());
  return position.ok() ? position->sector : body.sector->index;
}

void add_work(const Partition& partition, const Sector& sector, double ahead, LoadBySector& load) {
  if (!sector.world) return;
  std::vector<const HomeBody*> awake;
  for (const HomeBody* body : sector.homes) {
    if (sector.world->activity(body->slot) != Activity::kAsleep) awake.push_back(body);
  }
  const double others = kWorkOfSector + kWorkOfPair * static_cast<double>(sector.world->contacts().size());
  if (awake.empty() || ahead == 0) {
    load[sector.index].work += static_cast<double>(awake.size()) + others;
    return;
  }
  const double share = 1 + others / static_cast<double>(awake.size());
  for (const HomeBody* body : awake) load[sector_ahead(partition, *body, ahead)].work += share;
}

void count_sectors(const Partition& partition, LoadBySector& load) {
  const std::uint64_t stride =
      (partition.sectors.size() + partition.packed.counts().sectors) / kCountedMax + 1;
  const auto add = [&](const SectorIndex& index, std::size_t bodies) {
    if (stride > 1 && absl::HashOf(index) % stride != 0) return;
    LoadPiece& piece = load[index];
    piece.sectors += stride;
    piece.bodies += stride * bodies;
  };
  for (const auto& [index, sector] : partition.sectors) add(index, sector->homes.size());
  partition.packed.for_each(add);
}

// Divides by work and by the number of sectors alike, since those at rest have no work.
std::vector<LoadPiece> in_pieces(const std::vector<LoadPiece>& sectors, std::size_t pieces_max) {
  double work = 0;
  double count = 0;
  for (const LoadPiece& sector : sectors) {
    work += sector.work;
    count += static_cast<double>(sector.sectors);
  }
  std::vector<LoadPiece> pieces;
  double share = 0;  // of all sectors before, at most 1
  std::size_t ends = 0;
  for (const LoadPiece& sector : sectors) {
    const auto number = static_cast<std::size_t>(share * static_cast<double>(pieces_max));
    if (pieces.empty() || (number >= ends && pieces.size() < pieces_max)) {
      pieces.push_back({.first = sector.first});
      ends = number + 1;
    }
    LoadPiece& piece = pieces.back();
    piece.work += sector.work;
    piece.sectors += sector.sectors;
    piece.bodies += sector.bodies;
    const double by_count = count > 0 ? static_cast<double>(sector.sectors) / count : 0;
    share += work > 0 ? (sector.work / work + by_count) / 2 : by_count;
  }
  return pieces;
}

}  // namespace

std::vector<LoadPiece> load_along_curve(const Partition& partition, double ahead, std::size_t pieces_max) {
  LoadBySector by_sector;
  for (const Sector* sector : partition.active) add_work(partition, *sector, ahead, by_sector);
  count_sectors(partition, by_sector);
  std::vector<LoadPiece> sectors;
  sectors.reserve(by_sector.size());
  for (auto& [index, load] : by_sector) {
    load.first = index;
    sectors.push_back(load);
  }
  std::sort(sectors.begin(), sectors.end(), [&](const LoadPiece& a, const LoadPiece& b) {
    return comes_before_on_curve(a.first, b.first, partition.anchor);
  });
  return in_pieces(sectors, pieces_max);
}

}  // namespace tessera
