// Memory of this process.
#pragma once

#include <malloc.h>
#include <sys/resource.h>

#include <cstddef>

namespace tessera {

// Bytes allocated and not freed.
inline std::size_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// Peak resident memory.
inline std::size_t peak_bytes() {
  constexpr std::size_t kUnit = 1024;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * kUnit;
}

}  // namespace tessera
