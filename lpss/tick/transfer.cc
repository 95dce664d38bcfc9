#include "lpss/tick/transfer.h"

#include <algorithm>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/moved_sector.h"
#include "lpss/partition/world_state.h"

namespace tessera {
namespace {

// Of ticks, one in this many moves sectors while authority is shuffled.
constexpr std::uint64_t kShufflePeriod = 3;

}  // namespace

std::optional<SectorMap> shuffled_map(const Partition& partition, Tick tick) {
  const std::uint64_t shuffle = partition.settings.shuffle;
  if (shuffle == 0 || scrambled(shuffle ^ scrambled(tick)) % kShufflePeriod != 0) return std::nullopt;
  return SectorMap::scattered(partition.anchor, partition.map.servers(), scrambled(shuffle + tick),
                              partition.map.epoch() + 1);
}

std::vector<Transfer> give_sectors(Partition& partition, MapChange change) {
  partition.map = std::move(change.map);
  partition.self = change.self;
  std::vector<Sector*> leaving;
  for (const auto& [index, sector] : partition.sectors) {
    if (!partition.hosts(index)) leaving.push_back(sector.get());
  }
  std::sort(leaving.begin(), leaving.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
  const std::uint32_t servers = partition.map.servers();
  invariant(change.newcomers < servers && partition.self < servers, "a map is of the servers of the world");
  std::vector<Transfer> outbox(servers);
  if (change.newcomers > 0 && partition.self == 0) {
    for (Rank rank = servers - change.newcomers; rank < servers; ++rank)
      outbox[rank].heard = lately_heard(partition);
  }
  for (const Sector* sector : leaving) {
    outbox[partition.map.owner(sector->index)].sectors.push_back(
        with_parts(partition, pack_sector(partition, *sector)));
  }
  for (Sector* sector : leaving) forget_sector(partition, *sector);
  for (const SectorIndex& index : partition.packed.sectors()) {
    if (partition.hosts(index)) continue;
    outbox[partition.map.owner(index)].sectors.push_back(with_parts(partition, partition.packed.take(index)));
  }
  for (const Transfer& message : outbox) {
    for (const MovedSector& moved : message.sectors) {
      for (const MovedBody& body : moved.bodies) partition.body_moves.note_left(body.record.id);
    }
  }
  return outbox;
}

void take_sectors(Partition& partition, const std::vector<Transfer>& inbox) {
  std::vector<const MovedSector*> arriving;
  for (const Transfer& message : inbox) {
    if (message.heard) hear(partition, *message.heard);
    for (const MovedSector& moved : message.sectors) arriving.push_back(&moved);
  }
  std::sort(arriving.begin(), arriving.end(),
            [](const MovedSector* a, const MovedSector* b) { return a->sector < b->sector; });
  for (const MovedSector* moved : arriving) {
    unpack_sector(partition, *moved);
    partition.body_moves.note_arrived(moved->sector);
  }
  review_joints(partition);
}

}  // namespace tessera
