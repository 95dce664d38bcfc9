// The teleports of a tick.
#pragma once

#include <absl/container/btree_map.h>

#include <Eigen/Geometry>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/homes.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Turns a body at `next`, whose position is that of the body frame, as it is turned `now`; the position is
// then that of its centre.
void keep_rotation(const BodyProperties& properties, const BodyState& now, BodyState& next);

// They end the commands of the tick: until then, a body is where it was, with the orientation and the
// velocities that it lands with, so that other commands find it.
class Landings {
 public:
  void add(Partition& partition, const Teleport& jump);
  void forget(BodyId id) { jumps_.erase(id); }

  bool contains(BodyId id) const { return jumps_.contains(id); }

  // A body as it is now, or where it will land.
  BodyRecord record(const Partition& partition, const HomeBody& body) const;

  // Calls visit(BodyId), in ascending order, for all that jump, wherever they live.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    for (const auto& [id, landing] : jumps_) visit(id);
  }

  // Adds to the outbox the contacts of bodies that change frames together.
  std::vector<HomeChange> carry_out_all(Partition& partition, std::vector<Exchange>& outbox) const;

 private:
  struct Landing {
    Teleport jump;  // the last one of its body
    // Of the body, by all of its jumps in this tick.
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  };

  void keep_contacts(Partition& partition, std::vector<Exchange>& outbox) const;

  absl::btree_map<BodyId, Landing> jumps_;
};

}  // namespace tessera
