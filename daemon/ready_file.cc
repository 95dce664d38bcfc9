#include "daemon/ready_file.h"

#include <absl/strings/str_cat.h>

#include <cstdio>
#include <fstream>

namespace tessera {

absl::Status write_ready_file(const std::string& path, const std::string& address) {
  const std::string draft = path + ".new";
  const auto write_draft = [&] {
    std::ofstream file(draft, std::ios::trunc);
    file << address << '\n';
    return static_cast<bool>(file.flush());
  };
  if (!write_draft() || std::rename(draft.c_str(), path.c_str()) != 0) {
    return absl::UnavailableError(absl::StrCat("cannot write ", path));
  }
  return absl::OkStatus();
}

}  // namespace tessera
