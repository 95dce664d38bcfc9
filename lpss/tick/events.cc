#include "lpss/tick/events.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace tessera {
namespace {

ContactEvent end_of(Tick tick, BodyId a, BodyId b) {
  ContactEvent event;
  event.tick = tick;
  event.phase = ContactPhase::kEnd;
  event.a = a;
  event.b = b;
  return event;
}

void gather_sector(const Partition& partition, Tick tick, Sector& sector, std::vector<ContactEvent>& events) {
  absl::flat_hash_set<std::pair<BodyId, BodyId>> now;
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactPair& pair = pairs[i];
    if (!partition.rules.reports(partition, sector, pair)) continue;
    const bool has_begun = sector.touching.contains({pair.a, pair.b});
    for (ContactDetail& patch : sector.world->touching_patches(i)) {
      now.insert({pair.a, pair.b});
      ContactEvent event{patch_of(partition, sector, std::move(patch))};
      event.tick = tick;
      event.phase = has_begun ? ContactPhase::kPersist : ContactPhase::kBegin;
      event.a = pair.a;
      event.b = pair.b;
      events.push_back(std::move(event));
    }
  }
  for (const auto& [a, b] : sector.touching) {
    if (!now.contains({a, b})) events.push_back(end_of(tick, a, b));
  }
  sector.touching = std::move(now);
}

// Of a sector in which nothing is awake: commands have taken bodies away.
void gather_ends(Tick tick, Sector& sector, std::vector<ContactEvent>& events) {
  const std::span<const ContactPair> pairs = sector.world->contacts();
  absl::erase_if(sector.touching, [&](const std::pair<BodyId, BodyId>& ids) {
    const auto pair =
        std::ranges::lower_bound(pairs, ids, {}, [](const ContactPair& p) { return std::pair(p.a, p.b); });
    if (pair != pairs.end() && pair->a == ids.first && pair->b == ids.second) return false;
    events.push_back(end_of(tick, ids.first, ids.second));
    return true;
  });
}

}  // namespace

void report_contacts(Partition& partition, bool on) {
  if (on == partition.reports_contacts) return;
  partition.reports_contacts = on;
  partition.packed.report_contacts(on);
  for (auto& [index, sector] : partition.sectors) {
    sector->touching.clear();
    if (!on || !sector->world) continue;
    // Contacts that are there already do not begin.
    for (const ContactPair& pair : sector->world->contacts()) {
      if (pair.touching && partition.rules.reports(partition, *sector, pair))
        sector->touching.insert({pair.a, pair.b});
    }
  }
}

std::vector<ContactEvent> gather_events(Partition& partition, Tick tick, const std::vector<Sector*>& stepped,
                                        const Vacated& vacated, const ParallelFor& parallel) {
  std::vector<ContactEvent> events;
  if (!partition.reports_contacts) return events;
  std::vector<std::vector<ContactEvent>> by_sector(stepped.size());
  run_parallel(parallel, stepped.size(),
               [&](std::size_t i) { gather_sector(partition, tick, *stepped[i], by_sector[i]); });
  for (Sector* sector : partition.active) {
    if (sector->world && !sector->awake && !sector->touching.empty()) gather_ends(tick, *sector, events);
  }
  for (std::vector<ContactEvent>& some : by_sector)
    std::move(some.begin(), some.end(), std::back_inserter(events));
  for (const auto& [a, b] : vacated.ended_contacts) events.push_back(end_of(tick, a, b));
  // Patches of a pair stay in their order.
  std::stable_sort(events.begin(), events.end(), [](const ContactEvent& x, const ContactEvent& y) {
    return std::tie(x.a, x.b, x.phase) < std::tie(y.a, y.b, y.phase);
  });
  return events;
}

}  // namespace tessera
