// What the parts of a coordinator have in common.
#pragma once

#include <algorithm>
#include <cstdint>

#include "coordinator/coordinator.h"
#include "coordinator/event_log.h"
#include "coordinator/journal.h"
#include "coordinator/membership.h"
#include "coordinator/role_work.h"
#include "coordinator/server_choice.h"

namespace tessera {

// The numbers by which servers tell worlds apart. They grow: servers ignore what is older than what they
// have.
class WorldNumbers {
 public:
  // `max`: servers that have had worlds above it had them of other coordinators.
  WorldNumbers(std::uint64_t before, std::uint64_t max) : newest_(before), max_(max) {}

  void heard_of(std::uint64_t number) {
    if (number <= max_) newest_ = std::max(newest_, number);
  }
  std::uint64_t next() const { return newest_ + 1; }
  std::uint64_t take_next() { return ++newest_; }

 private:
  std::uint64_t newest_;
  const std::uint64_t max_;
};

struct CoordinatorContext {
  const CoordinatorOptions& options;
  const EventLog& log;
  Membership& members;
  const ServerChoice& choice;
  WorldNumbers& numbers;
  Journal& journal;
  RoleWork& role_work;

  // For the measurement of work; it stands still where there is no clock for that.
  Nanoseconds work_clock() const { return options.work_clock ? options.work_clock() : Nanoseconds::zero(); }

  // Whether a world goes on where it loses servers.
  bool has_checkpoints() const { return options.checkpoint_every > Nanoseconds::zero(); }
};

}  // namespace tessera
