// Random numbers from a seed, the same on every machine: the standard's distributions differ between
// libraries.
#pragma once

#include <cstdint>
#include <random>

namespace tessera {

class Dice {
 public:
  // One seed has several streams, so that the draws of one part of a simulation do not affect those of
  // others.
  Dice(std::uint64_t seed, std::uint32_t stream) {
    std::seed_seq both{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32), stream};
    engine_.seed(both);
  }

  // From 0 to count - 1. The bias of the remainder does not matter here.
  std::uint64_t below(std::uint64_t count) { return engine_() % count; }
  // Including both ends.
  std::uint64_t between(std::uint64_t low, std::uint64_t high) { return low + below(high - low + 1); }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  bool one_in(std::uint64_t count) { return below(count) == 0; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace tessera
