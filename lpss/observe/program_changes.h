// Whose programs have changed lately, for streams that tell only that.
#pragma once

#include <absl/functional/function_ref.h>

#include <cstdint>
#include <vector>

#include "lpss/observe/state.h"
#include "lpss/observe/world_hash.h"

namespace tessera {

// Counts looks at the partition. The programs of a body have changed at a look if any of their numbers, or
// why one was stopped, is other than at the look before, or if the body was not here then. A look must follow
// each tick: a body that leaves and comes back in between would not be noticed.
class ProgramChanges {
 public:
  // Between ticks.
  void look(const Partition& partition);

  // Nobody asks any more: ticks may pass without a look.
  void forget() { known_.clear(); }

  std::uint64_t looks() const { return looks_; }

  // Bodies whose programs have changed after a look, as they are now, ascending by id. 0: all that have
  // programs.
  void for_each_since(const Partition& partition, std::uint64_t look,
                      absl::FunctionRef<void(const ProgramsView&)> visit) const;

 private:
  struct Known {
    BodyId id;
    WorldHash programs;
    std::uint64_t changed = 0;  // the last look at which they had
  };

  std::uint64_t looks_ = 0;
  std::vector<Known> known_;  // at the last look, ascending by id
  std::vector<Known> before_;
};

}  // namespace tessera
