#include "lpss/base/freed_memory.h"

#include <malloc.h>

namespace tessera {

// To set the one stops the C library from adapting the other, which is 128 kB at first.
void keep_freed_memory() {
  constexpr int kMappedFrom = 32 << 20;  // bytes; the most that it accepts
  constexpr int kKept = 256 << 20;       // bytes
  mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  mallopt(M_TRIM_THRESHOLD, kKept);
}

void return_freed_memory() {
  constexpr int kMappedFrom = 256 << 10;  // bytes
  constexpr int kArenas = 2;
  mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  mallopt(M_ARENA_MAX, kArenas);
}

void give_back_freed_memory() { malloc_trim(0); }

}  // namespace tessera
