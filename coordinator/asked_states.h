// States of bodies that servers are asked for, for results that are made of these.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "coordinator/query_kinds.h"
#include "lpss/model/joint.h"
#include "proto/body_columns.h"

namespace tessera {

// A question about these bodies, those that do not exist left out; about none if there are none.
v1::Query ask_states_of(const std::set<std::uint64_t>& ids);

// Of all servers, ascending by ids. DATA_LOSS.
absl::StatusOr<std::vector<BodyRow>> states_of(const Parts& parts);

// Null if it is not among them.
const BodyRow* row_of(std::span<const BodyRow> rows, BodyId id);

// A body's centre frame relative to a sector nearby, and its velocities.
JointSide side_of(const BodyRow& row, const BodyProperties& properties, const SectorIndex& sector,
                  double sector_size);

}  // namespace tessera
