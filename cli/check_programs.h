// `run --check-programs`: whether the programs of a world do the same however it is run.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <string>

#include "lpss/model/world_description.h"

namespace tessera::cli {

// What a check found, while nothing differed.
struct CheckedPrograms {
  std::uint64_t ticks = 0;
  std::uint64_t instances_max = 0;  // that ran in a tick
};

// Runs the world in one partition; in three, whose sectors change hands all the time; and in two from halfway
// on, restored from a snapshot; all in this process. ABORTED, with the tick and the first program or body of
// which a number differs; errors as those of Simulation::create().
absl::StatusOr<CheckedPrograms> check_programs(const WorldDescription& world, std::uint64_t ticks);

std::string to_text(const CheckedPrograms& checked);

}  // namespace tessera::cli
