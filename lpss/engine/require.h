// What an engine asks of its callers.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace tessera {

// Stops the process with a message if the caller violated the interface.
inline void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "tessera engine: %s\n", rule);
  std::abort();
}

}  // namespace tessera
