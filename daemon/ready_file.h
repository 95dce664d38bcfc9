// How a process tells another that it serves, and where.
#pragma once

#include <absl/status/status.h>

#include <string>

namespace tessera {

// One line with the address; readers never see half of it.
absl::Status write_ready_file(const std::string& path, const std::string& address);

}  // namespace tessera
