// Keeps repeated warnings from filling the disk.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <spdlog/sinks/dist_sink.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace tessera {

// Passes at most `lines_max` warnings and errors within `window` that differ only in their numbers. The next
// one after that states how many were suppressed. Other lines always pass.
class RepeatFilter final : public spdlog::sinks::dist_sink<std::mutex> {
 public:
  RepeatFilter(std::size_t lines_max, std::chrono::seconds window) : lines_max_(lines_max), window_(window) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;

 private:
  struct Window {
    spdlog::log_clock::time_point start;
    std::size_t lines = 0;  // including suppressed ones
  };

  const std::size_t lines_max_;
  const std::chrono::seconds window_;
  absl::flat_hash_map<std::string, Window> windows_;  // by the common text of the lines
};

}  // namespace tessera
