// The formats of the log.
#pragma once

#include <spdlog/formatter.h>

#include <memory>
#include <string>

namespace tessera {

// Of a line of daemon `name`, by LogOptions::format:
//   text  2026-11-21 21:40:00.123 info coordinator: tick 120: server 3f2a joined
//   json
//   {"time":"2026-11-21T21:40:00.123+00:00","level":"info","daemon":"coordinator","tick":120,"message":"..."}
std::unique_ptr<spdlog::formatter> log_formatter(const std::string& name, const std::string& format);

}  // namespace tessera
