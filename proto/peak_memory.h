// How much memory a process has used, as statuses and reports tell it.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace tessera {

// The most physical memory that a process has had at once so far (VmHWM); 0 where there is no such process.
// Not getrusage()'s: a process that was started by another one begins with that one's peak there.
std::uint64_t peak_rss_bytes(pid_t process);

}  // namespace tessera
