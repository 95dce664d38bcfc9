#include "tessera/world_message.h"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <fstream>

#include "proto/convert.h"

namespace tessera {

absl::Status write_world_message(const std::filesystem::path& file, const WorldDescription& world) {
  std::ofstream out(file, std::ios::binary);
  if (to_proto(world).SerializeToOstream(&out) && out.flush()) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot write ", file.string()));
}

absl::StatusOr<WorldDescription> read_world_message(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file.string()));
  v1::World message;
  if (!message.ParseFromIstream(&in)) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), " is no world as `tessera convert` writes it"));
  }
  absl::StatusOr<WorldDescription> world = from_proto(message);
  if (world.ok()) return world;
  return absl::Status(world.status().code(), absl::StrCat(file.string(), ": ", world.status().message()));
}

}  // namespace tessera
