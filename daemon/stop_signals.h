// SIGINT and SIGTERM as a flag and a call.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "daemon/end_signals.h"

namespace tessera {

// Construct it before any other thread starts, so that no other thread receives the signals. `on_stop` is
// called on a thread of its own.
class StopSignals {
 public:
  explicit StopSignals(std::function<void()> on_stop);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  bool wanted() const { return wanted_; }

 private:
  std::function<void()> on_stop_;
  const EndSignals signals_;
  std::atomic<bool> wanted_ = false;
  std::thread thread_;
};

}  // namespace tessera
