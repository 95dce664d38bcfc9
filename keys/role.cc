#include "keys/role.h"

#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <utility>

namespace tessera {
namespace {

constexpr std::array<std::pair<absl::string_view, ClientRole>, kClientRoleCount> kNames = {
    {{"observe", ClientRole::kObserve},
     {"own", ClientRole::kOwn},
     {"control", ClientRole::kControl},
     {"admin", ClientRole::kAdmin}}};

constexpr absl::string_view kPackage = "/tessera.v1.";

struct Call {
  absl::string_view name;
  ClientRole role;
};

// All of them: a call that is missing here is refused, and a test misses it.
constexpr std::array kCalls = {
    Call{"Tessera/GetStatus", ClientRole::kObserve},
    // With commands, a request needs kOwn, and with ticks kControl: admit() in coordinator/session_calls.h.
    Call{"Tessera/Session", ClientRole::kObserve},
    Call{"Tessera/Do", ClientRole::kObserve},
    Call{"Streams/WatchBodies", ClientRole::kObserve},
    Call{"Streams/WatchContacts", ClientRole::kObserve},
    Call{"Streams/WatchSeams", ClientRole::kObserve},
    Call{"Streams/WatchDivergences", ClientRole::kObserve},
    Call{"Streams/WatchPrograms", ClientRole::kObserve},

    Call{"Tessera/Pause", ClientRole::kControl},
    Call{"Tessera/Resume", ClientRole::kControl},
    // It only reads, but the coordinator holds all of the world meanwhile.
    Call{"Tessera/Snapshot", ClientRole::kControl},

    Call{"Tessera/Load", ClientRole::kAdmin},
    Call{"Tessera/Unload", ClientRole::kAdmin},
    Call{"Tessera/Restore", ClientRole::kAdmin},
    Call{"Tessera/Drain", ClientRole::kAdmin},
    Call{"Tessera/Balance", ClientRole::kAdmin},
    Call{"Tessera/Shutdown", ClientRole::kAdmin},
    // Of a coordinator that stands by: it gets all of the world.
    Call{"Coordination/CopyStates", ClientRole::kAdmin},
};

}  // namespace

absl::string_view name_of(ClientRole role) { return kNames[static_cast<std::size_t>(role)].first; }

std::optional<ClientRole> parse_role(absl::string_view name) {
  const auto* found = std::ranges::find(kNames, name, &std::pair<absl::string_view, ClientRole>::first);
  if (found == kNames.end()) return std::nullopt;
  return found->second;
}

std::optional<ClientRole> role_needed(absl::string_view call) {
  if (!absl::ConsumePrefix(&call, kPackage)) return std::nullopt;
  const auto* found = std::ranges::find(kCalls, call, &Call::name);
  if (found == kCalls.end()) return std::nullopt;
  return found->role;
}

}  // namespace tessera
