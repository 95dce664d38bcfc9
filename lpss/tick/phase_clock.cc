#include "lpss/tick/phase_clock.h"

namespace tessera {

const char* name_of(TickPhase phase) {
  constexpr std::array<const char*, kTickPhases> kNames = {"sectorization", "seam search", "exchange",
                                                           "cloning",       "detection",   "islands",
                                                           "solving",       "integration", "programs"};
  return kNames.at(static_cast<std::size_t>(phase));
}

void PhaseClock::change_to(std::optional<TickPhase> phase) {
  if (!now_) return;
  const std::chrono::nanoseconds now = now_();
  if (phase_) times_.at(static_cast<std::size_t>(*phase_)) += now - since_;
  phase_ = phase;
  since_ = now;
}

}  // namespace tessera
