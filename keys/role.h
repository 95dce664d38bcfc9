// Who may make which call: three roles, each of which may do what the one before may.
#pragma once

#include <absl/strings/string_view.h>

#include <optional>

namespace tessera {

enum class ClientRole {
  kObserve,  // queries and streams: changes nothing
  kControl,  // commands, and the time of the world
  kAdmin,    // loads, ends and moves worlds and processes
};

absl::string_view name_of(ClientRole role);  // "observe", "control", "admin"
std::optional<ClientRole> parse_role(absl::string_view name);

// The least role that may make a call of the services in tessera.proto and standby.proto, as gRPC names it:
// "/tessera.v1.Tessera/Spawn". Nullopt for calls that there are not.
std::optional<ClientRole> role_needed(absl::string_view call);

}  // namespace tessera
