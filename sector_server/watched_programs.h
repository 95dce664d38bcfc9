// Which programs a client watches.
#pragma once

#include <absl/container/flat_hash_set.h>

#include <cstdint>
#include <string>

#include "lpss/observe/state.h"
#include "tessera.pb.h"

namespace tessera {

class WatchedPrograms {
 public:
  explicit WatchedPrograms(const v1::WatchProgramsRequest& request);

  // Those of a body, after the ones that the batch has.
  void add_those_of(const ProgramsView& of, v1::ProgramBatch& batch) const;

 private:
  bool wants(const std::string& kind) const;

  const absl::flat_hash_set<std::uint64_t> ids_;  // empty: all
  const std::string kind_;                        // empty: all
};

}  // namespace tessera
