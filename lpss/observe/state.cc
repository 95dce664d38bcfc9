#include "lpss/observe/state.h"

#include <algorithm>

#include "lpss/partition/bodies.h"

namespace tessera {

WorldHash hash_of(const Partition& partition) {
  WorldHash sum;
  for (const auto& [id, body] : partition.bodies) sum.add(record_of(*body), partition.anchor);
  partition.statics.for_each([&](const BodyRecord& record) {
    if (partition.hosts(record.home)) sum.add(record, partition.anchor);
  });
  return sum;
}

void for_each_body(const Partition& partition, const std::function<void(const BodyRecord&)>& visit) {
  std::vector<const HomeBody*> bodies;
  bodies.reserve(partition.bodies.size());
  for (const auto& [id, body] : partition.bodies) bodies.push_back(body.get());
  std::sort(bodies.begin(), bodies.end(), [](const HomeBody* a, const HomeBody* b) { return a->id < b->id; });
  for (const HomeBody* body : bodies) visit(record_of(*body));
}

void for_each_body_in(const Partition& partition, const std::function<bool(const SectorIndex&)>& wants,
                      const std::function<void(const BodyView&)>& visit) {
  for (const auto& [index, sector] : partition.sectors) {
    if (sector->homes.empty() || !wants(index)) continue;
    for (const HomeBody* body : sector->homes) {
      visit({body->id, sector->index, body->properties, sector->world->state(body->slot)});
    }
  }
}

std::optional<BodyRecord> body_of(const Partition& partition, BodyId id) {
  const auto found = partition.bodies.find(id);
  if (found == partition.bodies.end()) return std::nullopt;
  return record_of(*found->second);
}

}  // namespace tessera
