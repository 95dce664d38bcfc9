#include "lpss/tick/exchange.h"

#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/replicas.h"
#include "lpss/tick/inbox.h"
#include "lpss/tick/recipients.h"
#include "lpss/tick/seam_search.h"

namespace tessera {
namespace {

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
  body.replicated_in = body.wanted_in;
  body.known_everywhere = is_everywhere(body);
  body.dirty = false;
  const Ranks now = informed();
  if (before.empty() && now.empty()) return;
  announce(outbox, body.properties,
           {body.id, home, body.next_home.value_or(home), body.replicated_in,
            body.sector->world->state(body.slot)},
           before, now);
}

}  // namespace

void tell_of_replicas(Partition& partition, std::vector<Exchange>& outbox) {
  for (Sector* sector : partition.active) {
    OwnersAround around(partition.map, sector->index);
    for (HomeBody* body : sector->attended) {
      if (body->may_have_moved || !(body->wanted_in == body->replicated_in))
        tell_of(partition, around, *body, outbox);
    }
  }
}

void take_replicas(Partition& partition, std::vector<Exchange>& inbox) {
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
  for (const Exchange& message : inbox) {
    for (const ReplicaUpdate& update : message.replicas) {
      bring_back_holding(partition, update.id);
      const auto found = partition.replicas.find(update.id);
      invariant(found != partition.replicas.end(), "a replica is introduced before it is updated");
      Replica& replica = *found->second;
      revise(replica, update);
      if (replica.next_home != replica.home) partition.moving_replicas.push_back(replica.id);
      list_clones(partition, replica);
    }
  }
}

}  // namespace tessera
