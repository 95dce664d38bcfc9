// Two snapshots of a world, held against each other.
#pragma once

#include <absl/status/statusor.h>

#include <span>
#include <string>

#include "snapshot.pb.h"

namespace tessera::cli {

// Where the state of two snapshots first differs, for people: the tick, what all servers share, or a sector
// or body. Empty where all bits are equal. Errors as from_chunks().
absl::StatusOr<std::string> snapshot_difference(std::span<const v1::SnapshotChunk> a,
                                                std::span<const v1::SnapshotChunk> b);

}  // namespace tessera::cli
