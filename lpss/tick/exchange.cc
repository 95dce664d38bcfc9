#include "lpss/tick/exchange.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/replicas.h"
#include "lpss/tick/inbox.h"
#include "lpss/tick/recipients.h"
#include "lpss/tick/seam_search.h"

namespace tessera {
namespace {

// Of tell_of_replicas(): each has room for all servers.
constexpr std::size_t kOutboxesMax = 16;

// The owners of the sectors around one, for the few sets of these that its bodies need.
class OwnersAround {
 public:
  OwnersAround(const SectorMap& map, const SectorIndex& home) : map_(map), home_(home) {}

  Ranks of(const OffsetSet& targets) {
    if (targets.empty()) return {};
    for (const auto& [set, ranks] : known_) {
      if (set == targets) return ranks;
    }
    return known_.emplace_back(targets, owners(map_, home_, targets)).second;
  }

 private:
  const SectorMap& map_;
  const SectorIndex& home_;
  std::vector<std::pair<OffsetSet, Ranks>> known_;
};

void tell_of(const Partition& partition, OwnersAround& around, HomeBody& body,
             std::vector<Exchange>& outbox) {
  const SectorIndex& home = body.sector->index;
  const auto informed = [&] {
    return (body.known_everywhere ? everyone(partition.map) : Ranks{}) | around.of(body.replicated_in);
  };
  const Ranks before = informed();
  // What others have to hear of an island depends on it, also where all of that sleep: a body that forces
  // press may go far, and once it sleeps it does not.
  if (body.replicated_in.empty() != body.wanted_in.empty()) body.sector->components_stale = true;
  body.replicated_in = body.wanted_in;
  body.known_everywhere = is_everywhere(body.jointed, body.properties.motion, body.replicated_in);
  body.dirty = false;
  const Ranks now = informed();
  if (before.empty() && now.empty()) return;
  announce(
      outbox, body.properties,
      {body.id, home, body.next_home.value_or(home), body.replicated_in, body.sector->world->state(body.slot),
       body.known_everywhere, body.jointed, body.sector->world->surge(body.slot)},
      before, now);
}

void tell_of(const Partition& partition, const Sector& sector, std::vector<Exchange>& outbox) {
  OwnersAround around(partition.map, sector.index);
  for (HomeBody* body : sector.attended) {
    if (body->may_have_moved || !(body->wanted_in == body->replicated_in))
      tell_of(partition, around, *body, outbox);
  }
}

// Appends to the first of the outboxes what the others have of one kind.
template <typename T>
void join(std::span<std::vector<Exchange>> outboxes, std::vector<T> Exchange::*items) {
  for (std::size_t rank = 0; rank < outboxes[0].size(); ++rank) {
    std::vector<T>& all = outboxes[0][rank].*items;
    std::size_t count = 0;
    for (const std::vector<Exchange>& outbox : outboxes) count += (outbox[rank].*items).size();
    all.reserve(count);
    for (std::vector<Exchange>& outbox : outboxes.subspan(1))
      std::ranges::move(outbox[rank].*items, std::back_inserter(all));
  }
}

// Does what concerns the replica alone, which any thread may; false where lists of others change, too.
bool revise_alone(Replica& replica, const ReplicaUpdate& update) {
  revise(replica, update);
  return replica.next_home == replica.home && refresh_listed(replica);
}

void take_updates(Partition& partition, const std::vector<ReplicaUpdate>& updates,
                  const ParallelFor& parallel) {
  for (const ReplicaUpdate& update : updates) bring_back_holding(partition, update.id);
  const Pieces pieces(updates.size(), kBodiesInPiece);
  std::vector<std::vector<Replica*>> with_more_to_do(pieces.count());
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) {
      const auto found = partition.replicas.find(updates[n].id);
      invariant(found != partition.replicas.end(), "a replica is introduced before it is updated");
      Replica& replica = *found->second;
      if (!revise_alone(replica, updates[n])) with_more_to_do[piece].push_back(&replica);
    }
  });
  for (const std::vector<Replica*>& replicas : with_more_to_do) {
    for (Replica* replica : replicas) {
      if (replica->next_home != replica->home) partition.moving_replicas.push_back(replica->id);
      if (replica->goes_far()) {
        unlist_left_clones(partition, *replica);
        partition.far_replicas.push_back(replica->id);
      } else {
        list_clones(partition, *replica);
      }
    }
  }
}

}  // namespace

void tell_of_replicas(Partition& partition, std::vector<Exchange>& outbox, const ParallelFor& parallel) {
  const std::vector<Sector*>& sectors = partition.active;
  const std::size_t outboxes_max = parallel ? kOutboxesMax : 1;
  const Pieces pieces(sectors.size(), std::max(kSectorsInPiece, sectors.size() / outboxes_max + 1));
  const std::size_t servers = outbox.size();
  std::vector<std::vector<Exchange>> outboxes(std::max<std::size_t>(1, pieces.count()));
  outboxes[0] = std::move(outbox);
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    outboxes[piece].resize(servers);
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n)
      tell_of(partition, *sectors[n], outboxes[piece]);
  });
  join(outboxes, &Exchange::introductions);
  join(outboxes, &Exchange::replicas);
  join(outboxes, &Exchange::gone);
  outbox = std::move(outboxes[0]);
}

void take_replicas(Partition& partition, std::vector<Exchange>& inbox, const ParallelFor& parallel) {
  partition.moving_replicas.clear();
  for (const BodyId id : collected(inbox, &Exchange::gone, [](BodyId id) { return id; })) {
    bring_back_holding(partition, id);
    forget_replica(partition, id);
  }
  for (const ReplicaIntroduction& news :
       collected(inbox, &Exchange::introductions, [](const ReplicaIntroduction& i) { return i.id; })) {
    bring_back_holding(partition, news.id);
    introduce(partition, news);
  }
  // In any order: each changes the replica of one body, and what it says of sectors adds up.
  for (const Exchange& message : inbox) take_updates(partition, message.replicas, parallel);
}

void list_far_clones(Partition& partition) {
  std::vector<BodyId>& ids = partition.far_replicas;
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (const BodyId id : ids) {
    const auto found = partition.replicas.find(id);
    if (found != partition.replicas.end()) list_clones(partition, *found->second);
  }
  ids.clear();
}

}  // namespace tessera
