#include "lpss/tick/contact_points.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <tuple>

#include "lpss/partition/bodies.h"
#include "lpss/partition/packing.h"
#include "lpss/tick/inbox.h"
#include "lpss/tick/triggers.h"

namespace tessera {
namespace {

bool by_index(const Sector* a, const Sector* b) { return a->index < b->index; }

}  // namespace

// Every server that detected
// a pair with a moving body knows the homes of both: of its own bodies, and of replicas by the last exchange.
void send_contact_points(Partition& partition, std::vector<Exchange>& outbox) {
  if (partition.leaving.empty() && partition.moving_replicas.empty()) return;
  absl::flat_hash_set<BodyId> moving(partition.leaving.begin(), partition.leaving.end());
  moving.insert(partition.moving_replicas.begin(), partition.moving_replicas.end());
  std::vector<Sector*> concerned;
  for (const BodyId id : moving) {
    if (const auto body = partition.bodies.find(id); body != partition.bodies.end())
      concerned.push_back(body->second->sector);
    if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end()) {
      for (const std::unique_ptr<Clone>& clone : replica->second->clones) concerned.push_back(clone->sector);
    }
  }
  std::sort(concerned.begin(), concerned.end(), by_index);
  concerned.erase(std::unique(concerned.begin(), concerned.end()), concerned.end());

  for (Sector* sector : concerned) {
    if (!sector->world) continue;
    send_overlaps(partition, *sector, moving, outbox);
    const std::span<const ContactPair> pairs = sector->world->contacts();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const ContactPair& pair = pairs[i];
      if (!moving.contains(pair.a) && !moving.contains(pair.b)) continue;
      const SectorIndex& to = detecting_sector(motion_of(partition, pair.a), next_home(partition, pair.a),
                                               motion_of(partition, pair.b), next_home(partition, pair.b));
      const auto keeps_role = [&](BodyId id) {
        return motion_of(partition, id) == Motion::kStatic ||
               lives_in(partition, id, *sector) == (next_home(partition, id) == to);
      };
      const bool same_roles = to == sector->index && keeps_role(pair.a) && keeps_role(pair.b);
      if (same_roles) continue;
      const bool was_touching = sector->touching.erase({pair.a, pair.b}) > 0;
      ManifoldTransfer transfer{to, was_touching, {pair.a, pair.b, {}}};
      if (!partition.rules.clones_are_solved()) {
        transfer.manifold = sector->world->export_manifold(i);
      } else if (!was_touching) {
        continue;  // both sectors have points of their own; only the event is handed over
      }
      outbox[partition.map.owner(to)].manifolds.push_back(std::move(transfer));
    }
  }
}

void take_contact_points(Partition& partition, std::vector<Exchange>& inbox) {
  const auto order = [](const ManifoldTransfer& m) {
    return std::tuple(m.to, m.is_overlap, m.manifold.a, m.manifold.b);
  };
  for (ManifoldTransfer& transfer : collected(inbox, &Exchange::manifolds, order)) {
    bring_back(partition, transfer.to);
    const auto sector = partition.sectors.find(transfer.to);
    if (sector == partition.sectors.end() || !sector->second->world) continue;
    if (transfer.is_overlap) {
      take_overlap(*sector->second, transfer);
      continue;
    }
    if (!transfer.manifold.points.empty()) sector->second->world->import_manifold(transfer.manifold);
    if (transfer.was_touching) sector->second->touching.insert({transfer.manifold.a, transfer.manifold.b});
  }
}

}  // namespace tessera
