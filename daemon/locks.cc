#include "daemon/locks.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "daemon/address.h"

namespace tessera {

absl::StatusOr<std::optional<ServerKeys>> open_locks(const KeysOptions& options,
                                                     const std::string& inner_folder,
                                                     const std::vector<std::string>& addresses) {
  if (!options.folder.empty()) {
    absl::StatusOr<ServerKeys> keys = read_server_keys(options.folder, inner_folder);
    if (!keys.ok()) return keys.status();
    return *std::move(keys);
  }
  if (options.insecure) return std::nullopt;
  for (const std::string& address : addresses) {
    const std::optional<ListenAddress> parsed = parse_listen_address(address);
    if (!parsed || is_loopback(*parsed)) continue;  // who listens there says what is wrong with an address
    return absl::FailedPreconditionError(absl::StrCat(
        "without keys, whoever reaches ", address,
        " would control the world: make keys with `tessera keys create "
        "FOLDER` and give --keys FOLDER, or write --insecure (insecure = true) where all who reach it may"));
  }
  return std::nullopt;
}

absl::Status lock_bus(const KeysOptions& options, const std::optional<ServerKeys>& keys,
                      DdsNetwork& network) {
  if (network.interface == DdsNetwork().interface) return absl::OkStatus();
  if (keys) network.keys = std::filesystem::absolute(keys->folder).string();
  if (keys || options.insecure) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("without keys, whoever reaches the interface ", network.interface,
                   " could pose as a daemon of the cluster: make keys with `tessera keys create FOLDER` and "
                   "give --keys FOLDER, or "
                   "write --insecure (insecure = true) where only daemons reach it"));
}

}  // namespace tessera
