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

// The sectors hosted here that may have contacts of these bodies, ascending.
std::vector<Sector*> sectors_with(const Partition& partition, const absl::flat_hash_set<BodyId>& bodies) {
  std::vector<Sector*> concerned;
  for (const BodyId id : bodies) {
    if (const auto body = partition.bodies.find(id); body != partition.bodies.end())
      concerned.push_back(body->second->sector);
    if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end()) {
      for (const std::unique_ptr<Clone>& clone : replica->second->clones) concerned.push_back(clone->sector);
    }
  }
  std::sort(concerned.begin(), concerned.end(), by_index);
  concerned.erase(std::unique(concerned.begin(), concerned.end()), concerned.end());
  std::erase_if(concerned, [](const Sector* sector) { return !sector->world; });
  return concerned;
}

}  // namespace

// Every server that detected
// a pair with a moving body knows the homes of both: of its own bodies, and of replicas by the last exchange.
void send_contact_points(Partition& partition, std::vector<Exchange>& outbox) {
  if (partition.leaving.empty() && partition.moving_replicas.empty()) return;
  absl::flat_hash_set<BodyId> moving(partition.leaving.begin(), partition.leaving.end());
  moving.insert(partition.moving_replicas.begin(), partition.moving_replicas.end());
  for (Sector* sector : sectors_with(partition, moving)) {
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

void send_contacts_along(Partition& partition, const absl::flat_hash_map<BodyId, SectorIndex>& homes,
                         std::vector<Exchange>& outbox) {
  absl::flat_hash_set<BodyId> going;
  for (const auto& [id, home] : homes) going.insert(id);
  for (Sector* sector : sectors_with(partition, going)) {
    const std::span<const ContactPair> pairs = sector->world->contacts();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const ContactPair& pair = pairs[i];
      const auto a = homes.find(pair.a);
      const auto b = homes.find(pair.b);
      if (a == homes.end() || b == homes.end() || a->second.frame != b->second.frame ||
          a->second.frame == sector->index.frame)
        continue;
      const SectorIndex& to =
          detecting_sector(motion_of(partition, pair.a), a->second, motion_of(partition, pair.b), b->second);
      const Eigen::Matrix3d turn =
          (partition.felt_in(to).orientation().conjugate() * partition.felt_in(sector->index).orientation())
              .toRotationMatrix();
      const bool was_touching = sector->touching.erase({pair.a, pair.b}) > 0;
      outbox[partition.map.owner(to)].manifolds.push_back(
          {to, was_touching, partition.engine.turned(sector->world->export_manifold(i), turn)});
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
