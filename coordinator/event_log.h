// What a coordinator tells its operator.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "daemon/log_line.h"
#include "lpss/tick/messages.h"

namespace tessera {

class EventLog {
 public:
  // `tick`: the last one that the world has completed, if one is loaded.
  EventLog(LogSink sink, std::function<std::optional<Tick>()> tick)
      : sink_(std::move(sink)), tick_(std::move(tick)) {}

  void operator()(std::string text, Severity severity = Severity::kInfo) const {
    if (sink_) sink_({.severity = severity, .tick = tick_(), .text = std::move(text)});
  }

 private:
  const LogSink sink_;  // may be empty
  const std::function<std::optional<Tick>()> tick_;
};

}  // namespace tessera
