#include "proto/peak_memory.h"

#include <absl/strings/str_cat.h>

#include <fstream>
#include <string>

namespace tessera {

std::uint64_t peak_rss_bytes(pid_t process) {
  std::ifstream status(absl::StrCat("/proc/", process, "/status"));
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  return 0;
}

}  // namespace tessera
