#include "lpss/observe/state.h"

#include <algorithm>

#include "lpss/partition/bodies.h"

namespace tessera {

void for_each_programmed(const Partition& partition, absl::FunctionRef<void(const ProgramsView&)> visit) {
  std::vector<const HomeBody*> bodies;
  for (const auto& [index, sector] : partition.sectors)
    bodies.insert(bodies.end(), sector->programmed.begin(), sector->programmed.end());
  std::ranges::sort(bodies, {}, &HomeBody::id);
  for (const HomeBody* body : bodies) visit({body->id, body->programs});
}

std::optional<ProgramsView> programs_of(const Partition& partition, BodyId id) {
  const auto found = partition.bodies.find(id);
  if (found == partition.bodies.end() || found->second->programs.empty()) return std::nullopt;
  return ProgramsView{id, found->second->programs};
}

WorldHash program_hash_of(const Partition& partition) {
  WorldHash sum;
  for_each_programmed(partition, [&](const ProgramsView& of) { sum.add_programs(of.id, of.programs); });
  return sum;
}

WorldHash hash_of(const Partition& partition) {
  WorldHash sum;
  for (const auto& [id, body] : partition.bodies) sum.add(record_of(*body), partition.anchor);
  partition.packed.for_each([&](const SectorIndex& index, std::size_t) {
    partition.packed.for_each_body(index,
                                   [&](const BodyRecord& record) { sum.add(record, partition.anchor); });
  });
  partition.statics.for_each([&](const BodyRecord& record) {
    if (partition.hosts(record.home)) sum.add(record, partition.anchor);
  });
  return sum;
}

void for_each_body(const Partition& partition, const std::function<void(const BodyRecord&)>& visit) {
  const auto by_id = [](const auto* a, const auto* b) { return a->id < b->id; };
  std::vector<const HomeBody*> bodies;
  bodies.reserve(partition.bodies.size());
  for (const auto& [id, body] : partition.bodies) bodies.push_back(body.get());
  std::sort(bodies.begin(), bodies.end(), by_id);
  std::vector<BodyRecord> packed;
  packed.reserve(partition.packed.counts().bodies);
  partition.packed.for_each([&](const SectorIndex& index, std::size_t) {
    partition.packed.for_each_body(index, [&](const BodyRecord& record) { packed.push_back(record); });
  });
  std::sort(packed.begin(), packed.end(),
            [&](const BodyRecord& a, const BodyRecord& b) { return by_id(&a, &b); });
  auto next = packed.begin();
  for (const HomeBody* body : bodies) {
    for (; next != packed.end() && next->id < body->id; ++next) visit(*next);
    visit(record_of(*body));
  }
  for (; next != packed.end(); ++next) visit(*next);
}

void for_each_body_in(const Partition& partition, const std::function<bool(const SectorIndex&)>& wants,
                      bool awake_only, const std::function<void(const BodyView&)>& visit) {
  for (const auto& [index, sector] : partition.sectors) {
    if (sector->homes.empty() || !wants(index)) continue;
    for (const HomeBody* body : sector->homes) {
      visit({body->id, sector->index, body->properties, sector->world->state(body->slot)});
    }
  }
  if (awake_only) return;
  partition.packed.for_each([&](const SectorIndex& index, std::size_t) {
    if (!wants(index)) return;
    partition.packed.for_each_body(index, [&](const BodyRecord& record) {
      visit({record.id, record.home, record.properties, record.state});
    });
  });
}

std::optional<BodyRecord> body_of(const Partition& partition, BodyId id) {
  const auto found = partition.bodies.find(id);
  if (found == partition.bodies.end()) return partition.packed.body(id);
  return record_of(*found->second);
}

std::vector<BodyRecord> bodies_of(const Partition& partition, std::span<const BodyId> ids) {
  std::vector<BodyRecord> records;
  for (const BodyId id : ids) {
    if (const BodyRecord* const body = partition.statics.find(id)) {
      if (partition.hosts(body->home)) records.push_back(*body);
    } else if (const std::optional<BodyRecord> moving = body_of(partition, id)) {
      records.push_back(*moving);
    }
  }
  return records;
}

}  // namespace tessera
