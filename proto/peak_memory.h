// The memory of a process, for statuses and reports.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace tessera {

// The most physical memory that a process has had at once so far (VmHWM); 0 if there is no such process.
// getrusage() is no alternative: there, a process starts with the peak of the process that started it.
std::uint64_t peak_rss_bytes(pid_t process);

}  // namespace tessera
