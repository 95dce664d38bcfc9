// The log of a daemon: lines of text or JSON on standard error, with the tick if there is one.
#pragma once

#include <spdlog/formatter.h>

#include <memory>
#include <string>

#include "daemon/log_line.h"

namespace tessera {

struct LogOptions {
  std::string level = "info";   // trace, debug, info, warn, error or off
  std::string format = "text";  // or json
};

// Makes spdlog's default logger that of daemon `name`; frequent repetitions are suppressed (RepeatFilter).
void start_log(const std::string& name, const LogOptions& options);

// For lines of state machines. Safe to use from any thread.
void write_log(const LogLine& line);

// The formats:
//   text  2026-11-21 21:40:00.123 info coordinator: tick 120: server 3f2a joined
//   json
//   {"time":"2026-11-21T21:40:00.123+00:00","level":"info","daemon":"coordinator","tick":120,"message":"..."}
std::unique_ptr<spdlog::formatter> log_formatter(const std::string& name, const std::string& format);

}  // namespace tessera
