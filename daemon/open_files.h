// How many files and sockets this process may have open.
#pragma once

#include <cstddef>

namespace tessera {

// Raises the limit (RLIMIT_NOFILE) as far as the system lets it. What is allowed then.
std::size_t raise_open_files_max();

}  // namespace tessera
