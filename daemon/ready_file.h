// Tells another process that this one is ready, and its address.
#pragma once

#include <absl/status/status.h>

#include <string>

namespace tessera {

// One line with the address, written atomically.
absl::Status write_ready_file(const std::string& path, const std::string& address);

}  // namespace tessera
