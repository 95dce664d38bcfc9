// The processor time of the calling thread: what others do on the machine does not count.
#pragma once

#include <chrono>
#include <ctime>

namespace tessera {

inline std::chrono::nanoseconds processor_time_of_thread() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace tessera
