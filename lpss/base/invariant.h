// Stops the process where going on would compute nonsense.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace tessera {

// Aborts with `message` and the place of the call unless `holds`. For what can only fail through a mistake in
// this program; bad input and operating errors are status values.
inline void invariant(bool holds, const char* message,
                      const std::source_location& where = std::source_location::current()) {
  if (holds) [[likely]] {
    return;
  }
  std::fprintf(stderr, "%s:%u: broken invariant: %s\n", where.file_name(), where.line(), message);
  std::abort();
}

}  // namespace tessera
