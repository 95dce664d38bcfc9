// Gives back to the system what the packing of sectors has freed: it is of no use to the next tick.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "lpss/base/freed_memory.h"

namespace tessera {

class MemoryReturn {
 public:
  // `packed`: sectors that are, after a tick.
  void after_tick(std::size_t packed) {
    const bool goes_on = packed > std::exchange(before_, packed);
    given_back_ = std::min(given_back_, packed);
    if (goes_on || packed < given_back_ + kPackedMin) return;
    given_back_ = packed;
    give_back_freed_memory();
  }

 private:
  static constexpr std::size_t kPackedMin = 1024;  // since it was given back last

  std::size_t before_ = 0;      // at the end of the last tick
  std::size_t given_back_ = 0;  // when memory was given back
};

}  // namespace tessera
