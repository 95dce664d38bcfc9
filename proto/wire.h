// The bulk data of a tick as bytes: plain structs in their memory representation, packed one after the other.
//
// Only between processes of one build (ClusterMessage's handshake compares protocol and layout). Reading
// checks every count against the available bytes; a mismatch is DATA_LOSS.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lpss/partition/world_state.h"
#include "lpss/tick/messages.h"

namespace tessera {

inline constexpr std::uint32_t kClusterProtocol = 12;

// A hash of the sizes and versions of the packed structs and of the names of the counters; equal in
// compatible processes.
std::uint64_t wire_layout();

std::string pack(std::span<const BodyRecord> records);
std::string pack(std::span<const JointRecord> joints);
std::string pack(std::span<const Command> commands);
std::string pack(const RoundMessage& message);
std::string pack(const SharedState& state);
std::string pack(std::span<const MovedSector> sectors);
std::size_t packed_bytes(const MovedSector& sector);

absl::StatusOr<std::vector<BodyRecord>> unpack_records(std::string_view bytes);
absl::StatusOr<std::vector<JointRecord>> unpack_joints(std::string_view bytes);
absl::StatusOr<std::vector<Command>> unpack_commands(std::string_view bytes);
absl::StatusOr<RoundMessage> unpack_round(std::string_view bytes);
absl::StatusOr<SharedState> unpack_shared(std::string_view bytes);
absl::StatusOr<std::vector<MovedSector>> unpack_sectors(std::string_view bytes);

}  // namespace tessera
