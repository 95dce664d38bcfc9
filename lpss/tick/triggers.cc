#include "lpss/tick/triggers.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <tuple>
#include <utility>

#include "lpss/partition/bodies.h"
#include "lpss/partition/near_seam.h"

namespace tessera {
namespace {

ContactEvent event_of(Tick tick, ContactPhase phase, const Overlap& overlap) {
  ContactEvent event;
  event.tick = tick;
  event.phase = phase;
  event.trigger = true;
  event.a = overlap.trigger;
  event.b = overlap.visitor;
  return event;
}

const SectorIndex* home_of(const Partition& partition, BodyId id) {
  if (const auto body = partition.bodies.find(id); body != partition.bodies.end())
    return &body->second->sector->index;
  if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end())
    return &replica->second->home;
  return nullptr;
}

// Of two kinematic bodies, both homes find the pair, and the lower one counts.
bool counts(const Partition& partition, const Sector& sector, const Overlap& overlap) {
  if (motion_of(partition, overlap.trigger) != Motion::kKinematic ||
      motion_of(partition, overlap.visitor) != Motion::kKinematic)
    return true;
  const SectorIndex* const a = home_of(partition, overlap.trigger);
  const SectorIndex* const b = home_of(partition, overlap.visitor);
  return a == nullptr || b == nullptr || std::min(*a, *b) == sector.index;
}

// What looking at a sector has found.
struct Looked {
  std::vector<ContactEvent> events;
  std::vector<BodyId> changed;
};

void look(const Partition& partition, Tick tick, Sector& sector, Looked& looked) {
  std::vector<ContactEvent>& events = looked.events;
  std::vector<Overlap>& now = sector.found_overlaps;
  const bool is_stale = std::exchange(sector.overlaps_stale, false);
  sector.world->find_overlaps(is_stale ? std::span<const Overlap>() : sector.overlaps, now);
  std::erase_if(now, [&](const Overlap& overlap) { return !counts(partition, sector, overlap); });
  if (partition.reports_contacts) {
    for (const Overlap& overlap : sector.overlaps) {
      if (!std::ranges::binary_search(now, overlap))
        events.push_back(event_of(tick, ContactPhase::kEnd, overlap));
    }
    for (const Overlap& overlap : now) {
      const bool has_begun = std::ranges::binary_search(sector.overlaps, overlap);
      events.push_back(event_of(tick, has_begun ? ContactPhase::kPersist : ContactPhase::kBegin, overlap));
    }
  }
  std::vector<Overlap> changed;
  std::ranges::set_symmetric_difference(sector.overlaps, now, std::back_inserter(changed));
  for (const Overlap& overlap : changed) looked.changed.push_back(overlap.trigger);
  sector.overlaps.swap(now);
}

}  // namespace

std::vector<ContactEvent> look_at_triggers(Partition& partition, Tick tick, const Vacated& vacated,
                                           const ParallelFor& parallel, std::vector<BodyId>& changed) {
  std::vector<ContactEvent> events;
  // What has come out of a trigger may have taken the overlap to a server that has none.
  std::vector<Sector*> concerned;
  std::ranges::copy_if(partition.active, std::back_inserter(concerned), [](const Sector* sector) {
    return sector->world && (sector->world->has_triggers() || !sector->overlaps.empty());
  });
  if (concerned.empty() && vacated.ended_overlaps.empty()) return events;
  std::vector<Looked> by_sector(concerned.size());
  run_parallel(parallel, concerned.size(),
               [&](std::size_t n) { look(partition, tick, *concerned[n], by_sector[n]); });
  for (Looked& some : by_sector) {
    std::ranges::move(some.events, std::back_inserter(events));
    std::ranges::copy(some.changed, std::back_inserter(changed));
  }
  for (const Overlap& overlap : vacated.ended_overlaps) changed.push_back(overlap.trigger);
  if (!partition.reports_contacts) return events;
  for (const Overlap& overlap : vacated.ended_overlaps)
    events.push_back(event_of(tick, ContactPhase::kEnd, overlap));
  std::ranges::sort(events, {}, [](const ContactEvent& e) { return std::tie(e.a, e.b, e.phase); });
  return events;
}

void send_overlaps(Partition& partition, Sector& sector, const absl::flat_hash_set<BodyId>& moving,
                   std::vector<Exchange>& outbox) {
  std::erase_if(sector.overlaps, [&](const Overlap& overlap) {
    if (!moving.contains(overlap.trigger) && !moving.contains(overlap.visitor)) return false;
    const SectorIndex& to =
        sensing_sector(motion_of(partition, overlap.trigger), next_home(partition, overlap.trigger),
                       motion_of(partition, overlap.visitor), next_home(partition, overlap.visitor));
    if (to == sector.index) return false;
    ManifoldTransfer transfer{to, false, {overlap.trigger, overlap.visitor, {}}};
    transfer.is_overlap = true;
    outbox[partition.map.owner(to)].manifolds.push_back(std::move(transfer));
    return true;
  });
}

void take_overlap(Sector& sector, const ManifoldTransfer& transfer) {
  const Overlap overlap{transfer.manifold.a, transfer.manifold.b};
  const auto place = std::ranges::lower_bound(sector.overlaps, overlap);
  if (place == sector.overlaps.end() || *place != overlap) sector.overlaps.insert(place, overlap);
}

}  // namespace tessera
