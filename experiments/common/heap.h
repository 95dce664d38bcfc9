// Memory of this process.
#pragma once

#include <malloc.h>

#include <cstddef>

namespace tessera {

// What is allocated and not freed.
inline std::size_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace tessera
