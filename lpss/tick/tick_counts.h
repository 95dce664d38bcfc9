// What one server counts in one tick.
#pragma once

#include <cstdint>

namespace tessera {

// Sums over all servers do not depend on how many there are.
struct TickCounts {
  std::uint32_t sectors = 0;  // with a body that lives there, static ones not counted
  std::uint32_t sectors_awake = 0;
  std::uint32_t bodies_awake = 0;
  std::uint32_t clones = 0;                // in engine worlds
  std::uint32_t contacts = 0;              // pairs in awake sectors
  std::uint32_t islands_across_seams = 0;  // solved here, with bodies of more than one sector
  std::uint32_t islands_shipped = 0;       // of those, with bodies of more than one server
  std::uint32_t islands_cut = 0;           // beyond the cap: not solved whole, but coupled pass by pass
  std::uint32_t bodies_stopped = 0;        // left the range of numbers or sectors, and were stopped

  TickCounts& operator+=(const TickCounts& other);
};

}  // namespace tessera
