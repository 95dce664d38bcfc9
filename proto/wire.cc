#include "proto/wire.h"

#include <xxhash.h>

#include "lpss/base/invariant.h"
#include "lpss/model/tick_counts.h"
#include "proto/archive.h"

namespace tessera {

std::string stored_outline() { return outline_of<JointRecord, Command, SharedState, MovedSector>(); }

std::uint64_t stored_layout() {
  const std::string outline = stored_outline();
  return XXH3_64bits(outline.data(), outline.size());
}

std::uint64_t wire_layout() {
  std::string all =
      absl::StrCat(kClusterProtocol, " ", stored_outline(), outline_of<BodyRecord, RoundMessage>());
  for (const TickCounter& counter : kTickCounters) absl::StrAppend(&all, counter.name, " ");
  return XXH3_64bits(all.data(), all.size());
}

std::string pack(std::span<const BodyRecord> records) { return pack_list(records); }
std::string pack(std::span<const JointRecord> joints) { return pack_list(joints); }
std::string pack(std::span<const Command> commands) { return pack_list(commands); }
std::string pack(const RoundMessage& message) { return pack_struct(message); }
std::string pack(const SharedState& state) { return pack_struct(state); }
std::string pack(std::span<const MovedSector> sectors) { return pack_list(sectors); }
std::size_t packed_bytes(const MovedSector& sector) {
  Meter meter;
  meter(sector);
  return meter.size();
}

void PackedCommands::append(std::span<const Command> commands) {
  Meter meter;
  for (const Command& command : commands) meter(command);
  const std::size_t before = bytes_.size();
  bytes_.resize(before + meter.size());
  Writer writer(bytes_.data() + before);
  for (const Command& command : commands) writer(command);
  size_ += commands.size();
}

void PackedCommands::append(const PackedCommands& commands) {
  bytes_ += commands.bytes_;
  size_ += commands.size_;
}

std::string PackedCommands::list() const { return pack_struct(size_) + bytes_; }

std::vector<Command> PackedCommands::unpacked() const {
  absl::StatusOr<std::vector<Command>> commands = unpack_commands(list());
  invariant(commands.ok(), "what was packed can be unpacked");
  return *std::move(commands);
}

absl::StatusOr<std::vector<BodyRecord>> unpack_records(std::string_view bytes) {
  return unpack_struct<std::vector<BodyRecord>>(bytes, kStoredVersion, "body records");
}
absl::StatusOr<std::vector<JointRecord>> unpack_joints(std::string_view bytes, std::uint32_t version) {
  return unpack_struct<std::vector<JointRecord>>(bytes, version, "joints");
}
absl::StatusOr<std::vector<Command>> unpack_commands(std::string_view bytes, std::uint32_t version) {
  return unpack_struct<std::vector<Command>>(bytes, version, "commands");
}
absl::StatusOr<RoundMessage> unpack_round(std::string_view bytes) {
  return unpack_struct<RoundMessage>(bytes, kStoredVersion, "round of a tick");
}
absl::StatusOr<SharedState> unpack_shared(std::string_view bytes, std::uint32_t version) {
  return unpack_struct<SharedState>(bytes, version, "shared state");
}
absl::StatusOr<std::vector<MovedSector>> unpack_sectors(std::string_view bytes, std::uint32_t version) {
  return unpack_struct<std::vector<MovedSector>>(bytes, version, "sectors");
}

}  // namespace tessera
