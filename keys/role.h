// Who may make which call: four roles, each of which may do what the one before may.
#pragma once

#include <absl/strings/string_view.h>

#include <cstddef>
#include <optional>

namespace tessera {

enum class ClientRole {
  kObserve,  // queries and streams: changes nothing
  kOwn,      // commands for the bodies that the client owns
  kControl,  // commands, and the time of the world
  kAdmin,    // loads, ends and moves worlds and processes
};
inline constexpr std::size_t kClientRoleCount = 4;

absl::string_view name_of(ClientRole role);  // "observe", "own", "control", "admin"
std::optional<ClientRole> parse_role(absl::string_view name);

// The least role that may make a call of the services in tessera.proto and standby.proto, as gRPC names it:
// "/tessera.v1.Tessera/Spawn". Nullopt for calls that there are not.
std::optional<ClientRole> role_needed(absl::string_view call);

}  // namespace tessera
