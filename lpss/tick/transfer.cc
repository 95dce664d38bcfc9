#include "lpss/tick/transfer.h"

#include <algorithm>

#include "lpss/partition/moved_sector.h"

namespace tessera {
namespace {

// Of ticks, one in this many moves sectors while authority is shuffled.
constexpr std::uint64_t kShufflePeriod = 3;

}  // namespace

bool moves_sectors(const WorldSettings& settings, Tick tick) {
  return settings.shuffle != 0 && scrambled(settings.shuffle ^ scrambled(tick)) % kShufflePeriod == 0;
}

std::vector<Transfer> give_sectors(Partition& partition, Tick tick) {
  const std::uint64_t seed = scrambled(partition.settings.shuffle + tick);
  partition.map =
      SectorMap::scattered(partition.anchor, partition.map.servers(), seed, partition.map.epoch() + 1);
  std::vector<Sector*> leaving;
  for (const auto& [index, sector] : partition.sectors) {
    if (!partition.hosts(index)) leaving.push_back(sector.get());
  }
  std::sort(leaving.begin(), leaving.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
  std::vector<Transfer> outbox(partition.map.servers());
  for (const Sector* sector : leaving) {
    outbox[partition.map.owner(sector->index)].sectors.push_back(pack_sector(*sector));
  }
  for (Sector* sector : leaving) forget_sector(partition, *sector);
  return outbox;
}

void take_sectors(Partition& partition, const std::vector<Transfer>& inbox) {
  std::vector<const MovedSector*> arriving;
  for (const Transfer& message : inbox) {
    for (const MovedSector& moved : message.sectors) arriving.push_back(&moved);
  }
  std::sort(arriving.begin(), arriving.end(),
            [](const MovedSector* a, const MovedSector* b) { return a->sector < b->sector; });
  for (const MovedSector* moved : arriving) unpack_sector(partition, *moved);
}

}  // namespace tessera
