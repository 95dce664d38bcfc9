// Where the time of a tick goes.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

namespace tessera {

// What a server does in a tick. A phase that works on many sectors, maybe on several threads, lasts from the
// first to the last of them.
enum class TickPhase : std::uint8_t {
  kSectorization,  // commands take effect; bodies change home, with their contact points; the next moves are
                   // announced
  kSeamSearch,     // boxes swept by each body, and the sectors that these reach
  kExchange,       // what is told of bodies near seams, written and read; sectors that change servers
  kCloning,        // clones, and statics that a sector needs, enter and leave engine worlds and follow their
                   // originals
  kDetection,      // gravity, and contacts in every awake sector
  kIslands,  // connected bodies in sectors and across borders, who solves them, and what the solver is given
  kSolving,  // islands, whole or in parts that agree pass by pass
  kIntegration,  // velocities become motion; contact events; what is at rest leaves the list
  kPrograms,     // they ask, are answered, decide and act
};
inline constexpr std::size_t kTickPhases = 9;

// "sectorization", "seam search", ...
const char* name_of(TickPhase phase);

using PhaseTimes = std::array<std::chrono::nanoseconds, kTickPhases>;  // by phase

// The time since some fixed moment; never goes back.
using TimeSource = std::function<std::chrono::nanoseconds()>;

// Adds up how long each phase takes. Reads its source once whenever the phase changes.
class PhaseClock {
 public:
  // Without a source nothing is measured, and all times stay zero.
  explicit PhaseClock(TimeSource now) : now_(std::move(now)) {}

  // Forgets all times.
  void reset() { times_ = {}; }

  // What follows belongs to `phase` ...
  void enter(TickPhase phase) { change_to(phase); }
  // ... and what follows this, to none.
  void leave() { change_to(std::nullopt); }

  const PhaseTimes& times() const { return times_; }

 private:
  void change_to(std::optional<TickPhase> phase);

  TimeSource now_;
  PhaseTimes times_{};
  std::optional<TickPhase> phase_;
  std::chrono::nanoseconds since_{};  // when it was entered
};

}  // namespace tessera
