// The log of a daemon: lines of text or JSON on standard error, with the tick if there is one.
#pragma once

#include <absl/strings/string_view.h>

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

// For lines that concern no world. Safe to use from any thread.
void log_info(absl::string_view text);
void log_warning(absl::string_view text);
void log_error(absl::string_view text);

}  // namespace tessera
