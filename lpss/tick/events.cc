#include "lpss/tick/events.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <tuple>

#include "lpss/partition/bodies.h"
#include "lpss/partition/near_seam.h"

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

// Whether this sector reports the pair. Under the policy clone both sectors of a pair detect it; the one
// that would under the policy island reports it, and nobody reports what two clones do.
bool reports(const Partition& partition, const Sector& sector, const ContactPair& pair) {
  if (partition.settings.seams == SeamPolicy::kIsland) return true;
  const auto home_of = [&](BodyId id) -> const SectorIndex& {
    if (const auto body = partition.bodies.find(id); body != partition.bodies.end())
      return body->second->sector->index;
    if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end())
      return replica->second->home;
    return sector.index;
  };
  return detecting_sector(motion_of(partition, pair.a), home_of(pair.a), motion_of(partition, pair.b),
                          home_of(pair.b)) == sector.index;
}

void gather_sector(const Partition& partition, Tick tick, Sector& sector, std::vector<ContactEvent>& events) {
  absl::flat_hash_set<std::pair<BodyId, BodyId>> now;
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactPair& pair = pairs[i];
    if (!reports(partition, sector, pair)) continue;
    const ContactDetail detail = sector.world->contact_detail(i);
    if (detail.depth < 0 && detail.impulse <= 0) continue;
    now.insert({pair.a, pair.b});
    ContactEvent event;
    event.tick = tick;
    event.phase = sector.touching.contains({pair.a, pair.b}) ? ContactPhase::kPersist : ContactPhase::kBegin;
    event.a = pair.a;
    event.b = pair.b;
    const absl::StatusOr<WorldPosition> position =
        canonical(sector.index, detail.position, partition.sector_size());
    if (position.ok()) event.position = *position;
    Eigen::Map<Eigen::Vector3d>(event.normal.data()) = detail.normal;
    event.impulse = detail.impulse;
    event.depth = detail.depth;
    events.push_back(event);
  }
  for (const auto& [a, b] : sector.touching) {
    if (!now.contains({a, b})) events.push_back(end_of(tick, a, b));
  }
  sector.touching = std::move(now);
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
      if (pair.touching && reports(partition, *sector, pair)) sector->touching.insert({pair.a, pair.b});
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
  for (std::vector<ContactEvent>& some : by_sector)
    std::move(some.begin(), some.end(), std::back_inserter(events));
  for (const auto& [a, b] : vacated.ended_contacts) events.push_back(end_of(tick, a, b));
  std::sort(events.begin(), events.end(), [](const ContactEvent& x, const ContactEvent& y) {
    return std::tie(x.a, x.b, x.phase) < std::tie(y.a, y.b, y.phase);
  });
  return events;
}

}  // namespace tessera
