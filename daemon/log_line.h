// What the state machines of the daemons tell an operator: they know no log, only that somebody listens.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace tessera {

enum class Severity { kInfo, kWarning, kError };

struct LogLine {
  Severity severity = Severity::kInfo;
  std::optional<std::uint64_t> tick;  // completed; where the line concerns a world that runs
  std::string text;
};

using LogSink = std::function<void(const LogLine&)>;

}  // namespace tessera
