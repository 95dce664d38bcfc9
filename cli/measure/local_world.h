// Worlds that are stepped in this process: in sectors, or as people do without Tessera.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <memory>
#include <span>
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

  // Carries out commands, and does a tick. One world knows no commands but drives.
  virtual void step(std::span<const Command> commands) = 0;
  void step() { step({}); }
  void run(Tick ticks) {
    for (Tick tick = 0; tick < ticks; ++tick) step();
  }

  // Those that can move, in ascending order of ids.
  virtual std::vector<BodyRecord> bodies() const = 0;

  // Of the last tick, where they were asked for before it, and in sectors alone.
  virtual void gather_contacts(bool /*gathers*/) {}
  virtual std::vector<ContactEvent> contacts() const { return {}; }
  // Bodies that were stopped in the last tick; in sectors alone.
  virtual std::size_t diverged() const { return 0; }

  // Steps, and says how deep (m) two bodies overlap at most in that tick; 0 where contacts are not told.
  double step_for_overlap();

  // Of one world, a hash that only other runs in one world can be compared with.
  virtual WorldHash hash() const { return {}; }
};

// Errors: those of PartitionCluster::create() or PlainWorld::create(). `free_flight` as in PartitionOptions.
absl::StatusOr<std::unique_ptr<LocalWorld>> in_sectors(const WorldDescription& world,
                                                       bool free_flight = true);
absl::StatusOr<std::unique_ptr<LocalWorld>> in_one_world(const WorldDescription& world);

}  // namespace tessera
