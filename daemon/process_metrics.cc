#include "daemon/process_metrics.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "daemon/metric_families.h"
#include "proto/peak_memory.h"

namespace tessera {
namespace {

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0;
  double resident = 0;
  statm >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// Close enough to the start: this runs when the program is loaded.
const double start_seconds =
    std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();

}  // namespace

std::vector<prometheus::MetricFamily> process_metrics() {
  return {
      counter("process_cpu_seconds_total", "User and system CPU time of this process", cpu_seconds()),
      gauge("process_resident_memory_bytes", "Resident memory of this process", resident_bytes()),
      gauge("process_resident_memory_max_bytes", "Maximum resident memory of this process",
            static_cast<double>(peak_rss_bytes(getpid()))),
      gauge("process_start_time_seconds", "When this process started, since the epoch", start_seconds),
      gauge("tessera_build_info", "The version of this daemon", 1, {{"version", TESSERA_VERSION}}),
  };
}

}  // namespace tessera
