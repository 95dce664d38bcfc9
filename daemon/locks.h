// Whether a daemon may listen where it is told to, and with which keys.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "keys/gate.h"
#include "transport/dds_network.h"

namespace tessera {

struct KeysOptions {
  std::string folder;     // of `tessera keys create`; empty: none
  bool insecure = false;  // listens beyond loopback without keys
};

// The keys of the options; nullopt where there are none. FAILED_PRECONDITION, with what to do, if there are
// none and one of `addresses` (host:port; empty ones are skipped) is not of loopback, unless that is wanted;
// otherwise as read_server_keys().
absl::StatusOr<std::optional<ServerKeys>> open_locks(const KeysOptions& options,
                                                     const std::string& inner_folder,
                                                     const std::vector<std::string>& addresses);

// Has the bus between daemons use `keys`, unless it is that of loopback, which other hosts do not reach.
// FAILED_PRECONDITION, with what to do, without keys on another interface, unless that is wanted.
absl::Status lock_bus(const KeysOptions& options, const std::optional<ServerKeys>& keys, DdsNetwork& network);

}  // namespace tessera
