#include "lpss/tick/exchange.h"

#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/replicas.h"
#include "lpss/tick/inbox.h"
#include "lpss/tick/recipients.h"
#include "lpss/tick/seam_search.h"

namespace tessera {
namespace {

void tell_of(Partition& partition, HomeBody& body, std::vector<Exchange>& outbox) {
  const SectorIndex& home = body.sector->index;
  const auto informed = [&] {
    return (body.known_everywhere ? everyone(partition.map) : 0) |
           owners(partition.map, home, body.replicated_in);
  };
  const Ranks before = informed();
  body.replicated_in = body.wanted_in;
  body.known_everywhere = is_everywhere(body);
  body.dirty = false;
  const Ranks now = informed();
  if (before == 0 && now == 0) return;
  announce(outbox, body.properties,
           {body.id, home, body.next_home.value_or(home), body.replicated_in,
            body.sector->world->state(body.slot)},
           before, now);
}

}  // namespace

void tell_of_replicas(Partition& partition, std::vector<Exchange>& outbox) {
  for (Sector* sector : partition.active) {
    for (HomeBody* body : sector->attended) {
      if (may_have_moved(*body) || !(body->wanted_in == body->replicated_in))
        tell_of(partition, *body, outbox);
    }
  }
}

void take_replicas(Partition& partition, std::vector<Exchange>& inbox) {
  partition.moving_replicas.clear();
  for (const BodyId id : collected(inbox, &Exchange::gone, [](BodyId id) { return id; }))
    forget_replica(partition, id);
  for (const ReplicaIntroduction& news :
       collected(inbox, &Exchange::introductions, [](const ReplicaIntroduction& i) { return i.id; })) {
    introduce(partition, news);
  }
  for (ReplicaUpdate& update :
       collected(inbox, &Exchange::replicas, [](const ReplicaUpdate& u) { return u.id; })) {
    const auto found = partition.replicas.find(update.id);
    invariant(found != partition.replicas.end(), "a replica is introduced before it is updated");
    Replica& replica = *found->second;
    revise(replica, update);
    if (replica.next_home != replica.home) partition.moving_replicas.push_back(replica.id);
    place_replica(partition, replica);
  }
}

}  // namespace tessera
