// Messages of the daemons' state machines to the operator. The state machines know a sink, not a log.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace tessera {

enum class Severity { kInfo, kWarning, kError };

struct LogLine {
  Severity severity = Severity::kInfo;
  std::optional<std::uint64_t> tick;  // completed; set if the line concerns a loaded world
  std::string text;
};

using LogSink = std::function<void(const LogLine&)>;

}  // namespace tessera
