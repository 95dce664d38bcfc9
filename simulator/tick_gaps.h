// How long a world that is to run stands still.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera {

// Times are those of the network, ns. Only what lies within a step counts.
class TickGaps {
 public:
  void begin(std::uint64_t now_ns) {
    is_running_ = true;
    last_ns_ = now_ns;
  }
  // A tick has been done that had not been done before.
  void tick(std::uint64_t now_ns) {
    if (!is_running_) return;
    longest_ns_ = std::max(longest_ns_, now_ns - last_ns_);
    last_ns_ = now_ns;
  }
  void end(std::uint64_t now_ns) {
    tick(now_ns);
    is_running_ = false;
  }

  std::uint64_t longest_ns() const { return longest_ns_; }

 private:
  bool is_running_ = false;
  std::uint64_t last_ns_ = 0;
  std::uint64_t longest_ns_ = 0;
};

}  // namespace tessera
