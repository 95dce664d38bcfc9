// Servers that begin to take part in a running world, and those that leave it: changes of the map between two
// ticks, as others, that nobody goes back for.
//
// One that is to take part gets ready beside the world: it loads what all servers know alike, as of the last
// checkpoint, and then follows the grants, without anything to do for their ticks (v1::Guest). A map with it
// among the servers makes it one of them, without sectors; the next maps give it its share. One that is to
// leave gives its sectors away, by as many maps as that takes, and a last map has it no longer. It is needed
// until all others have that: only then have they received all that it has sent.
//
// A guest that some of the servers do not answer waits until they do, unless another change is to be made:
// then it is sent away.
//
// One change follows the other. Where a server that is needed is lost in between, the world goes back to a
// checkpoint as ever.
#pragma once

#include <optional>
#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/balancing.h"
#include "coordinator/checkpoints.h"
#include "coordinator/context.h"

namespace tessera {

class ServerChanges {
 public:
  // All must outlive this.
  ServerChanges(const CoordinatorContext& context, ActiveWorld& world, Balancing& balancing)
      : context_(context), world_(world), balancing_(balancing) {}

  // Goes on with the change that is under way, or begins the next one.
  void tend(const Checkpoints& checkpoints, Nanoseconds now);
  std::optional<Nanoseconds> next_deadline() const;

  // The guest reports whom of the servers it waits for, as they do not answer it.
  void guest_awaits(const std::vector<v1::Unheard>& unheard);
  // The guest has answered.
  void guest_is_loaded(const v1::Loaded& loaded);
  // The grant with this map has gone out: the next ticks are those of its servers.
  void change_servers(const v1::SectorMap& map);

 private:
  bool others_wait(const std::vector<NodeId>& wanted) const;
  bool invite(NodeId node, const Checkpoints& checkpoints);
  void dismiss_guest();
  void admit_guest();
  void remove(std::size_t rank);

  const CoordinatorContext& context_;
  ActiveWorld& world_;
  Balancing& balancing_;
};

}  // namespace tessera
