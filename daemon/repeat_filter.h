// Keeps a warning that comes again and again from filling the disk.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <spdlog/sinks/dist_sink.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace tessera {

// Hands on, of warnings and errors that differ in their numbers only, at most `lines_max` within `window`.
// The next one after that says how many were left out. What is no warning passes.
class RepeatFilter final : public spdlog::sinks::dist_sink<std::mutex> {
 public:
  RepeatFilter(std::size_t lines_max, std::chrono::seconds window) : lines_max_(lines_max), window_(window) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;

 private:
  struct Window {
    spdlog::log_clock::time_point start;
    std::size_t lines = 0;  // also those left out
  };

  const std::size_t lines_max_;
  const std::chrono::seconds window_;
  absl::flat_hash_map<std::string, Window> windows_;  // by what lines have in common
};

}  // namespace tessera
