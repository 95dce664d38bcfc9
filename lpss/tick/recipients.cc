#include "lpss/tick/recipients.h"

namespace tessera {

Ranks owners(const SectorMap& map, const SectorIndex& home, const OffsetSet& targets) {
  Ranks ranks = 0;
  targets.for_each([&](const SectorOffset& offset) {
    const absl::StatusOr<SectorIndex> sector = translated(home, offset);
    if (sector.ok()) ranks |= Ranks{1} << map.owner(*sector);
  });
  return ranks;
}

Ranks everyone(const SectorMap& map) { return ~Ranks{0} >> (64 - map.servers()); }

void announce(std::vector<Exchange>& outbox, const BodyProperties& properties, const ReplicaUpdate& update,
              Ranks before, Ranks now) {
  for_each_rank(before & ~now, [&](Rank rank) { outbox[rank].gone.push_back(update.id); });
  for_each_rank(now & ~before, [&](Rank rank) {
    outbox[rank].introductions.push_back({update.id, properties});
  });
  for_each_rank(now, [&](Rank rank) { outbox[rank].replicas.push_back(update); });
}

}  // namespace tessera
