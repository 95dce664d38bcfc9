// Worlds that are stepped in this process: in sectors, or as people do without Tessera.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/world_description.h"
#include "lpss/observe/world_hash.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Not for several threads at a time.
class LocalWorld {
 public:
  virtual ~LocalWorld() = default;

  virtual void step() = 0;
  void run(Tick ticks) {
    for (Tick tick = 0; tick < ticks; ++tick) step();
  }

  // Steps, and says how deep (m) two bodies overlap at most in that tick; 0 of one world, which does not
  // know.
  virtual double step_for_overlap() = 0;

  // Those that can move, in ascending order of ids.
  virtual std::vector<BodyRecord> bodies() const = 0;

  // Of one world, a hash that only other runs in one world can be compared with.
  virtual WorldHash hash() const = 0;
};

// Errors: those of PartitionCluster::create() or PlainWorld::create(). `free_flight` as in PartitionOptions.
absl::StatusOr<std::unique_ptr<LocalWorld>> in_sectors(const WorldDescription& world,
                                                       bool free_flight = true);
absl::StatusOr<std::unique_ptr<LocalWorld>> in_one_world(const WorldDescription& world);

}  // namespace tessera
