// The scenes of golden_hashes.tsv: worlds of the repository, and small ones built in code.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"

namespace tessera {

struct GoldenScene {
  std::string name;
  Tick ticks = 0;  // the hash is that after the last of them
  std::function<absl::StatusOr<WorldDescription>()> world;
  // Commands of clients at the beginning of a tick (from 1 on); empty: none.
  std::function<std::vector<Command>(Tick)> commands{};
};

// In the order of the file; names are unique.
const std::vector<GoldenScene>& golden_scenes();

}  // namespace tessera
