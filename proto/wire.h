// The bulk data of a tick as bytes: plain structs in their memory representation, packed one after the other.
//
// Messages go only between processes that describe them alike (ClusterMessage's handshake compares protocol
// and layout). What is stored has a version, and that of earlier versions is read, too: a field that comes
// new is described by since() (lpss/base/since.h), with the version that is then one higher. Reading checks
// every count against the available bytes; a mismatch is DATA_LOSS.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lpss/partition/world_state.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Of what daemons say to each other, and of what they compute: another number where either changes.
inline constexpr std::uint32_t kClusterProtocol = 19;

// Of joints, commands, sectors and what all share, in snapshots and stores.
inline constexpr std::uint32_t kStoredVersion = 8;
inline constexpr std::uint32_t kStoredVersionMin = 4;  // the earliest that is read

// What they consist of, field by field, and a hash of that, which each version has of its own.
std::string stored_outline();
std::uint64_t stored_layout();

// A hash of what all messages consist of, and of the names of the counters; equal in processes that can work
// together.
std::uint64_t wire_layout();

std::string pack(std::span<const BodyRecord> records);
std::string pack(std::span<const JointRecord> joints);
std::string pack(std::span<const Command> commands);
std::string pack(const RoundMessage& message);
std::string pack(const SharedState& state);
std::string pack(std::span<const MovedSector> sectors);
std::size_t packed_bytes(const MovedSector& sector);

// Commands that are kept as bytes, which take a tenth of the memory.
class PackedCommands {
 public:
  PackedCommands() = default;
  PackedCommands(std::initializer_list<Command> commands) : PackedCommands(std::span(commands)) {}
  explicit PackedCommands(std::span<const Command> commands) { append(commands); }

  void append(std::span<const Command> commands);
  void append(const Command& command) { append({&command, 1}); }
  void append(const PackedCommands& commands);

  bool empty() const { return size_ == 0; }

  std::size_t size() const { return size_; }
  // What pack() makes of all of them.
  std::string list() const;
  std::vector<Command> unpacked() const;

 private:
  std::string bytes_;  // of one after the other
  std::uint64_t size_ = 0;
};

absl::StatusOr<std::vector<BodyRecord>> unpack_records(std::string_view bytes);
absl::StatusOr<std::vector<JointRecord>> unpack_joints(std::string_view bytes,
                                                       std::uint32_t version = kStoredVersion);
absl::StatusOr<std::vector<Command>> unpack_commands(std::string_view bytes,
                                                     std::uint32_t version = kStoredVersion);
absl::StatusOr<RoundMessage> unpack_round(std::string_view bytes);
absl::StatusOr<SharedState> unpack_shared(std::string_view bytes, std::uint32_t version = kStoredVersion);
absl::StatusOr<std::vector<MovedSector>> unpack_sectors(std::string_view bytes,
                                                        std::uint32_t version = kStoredVersion);

}  // namespace tessera
