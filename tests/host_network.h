// Hosts on this machine: network namespaces, and a switch between them that can cut, delay and lose. For
// root.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace tessera::testing {

// The namespaces have no names, and end with this object and the processes on them. Nothing leaves them.
class HostNetwork {
 public:
  static constexpr const char* kInterface = "eth0";
  static constexpr std::size_t kHostsMax = 32;

  // Throws std::system_error where the system refuses.
  explicit HostNetwork(std::size_t hosts);
  ~HostNetwork();

  std::string address(std::size_t host) const;

  // From now on, the calling thread, and processes and threads that it starts, are on this host.
  void enter(std::size_t host) const;

  // Nothing reaches the host, and nothing from it the others, until it is healed.
  void cut(std::size_t host, bool is_cut);
  // Nothing that the one sends reaches the other.
  void cut_way(std::size_t from, std::size_t to, bool is_cut);
  // Every packet takes so long, and so many of 1000 are lost.
  void disturb(std::chrono::milliseconds delay, int lost_of_1000);

 private:
  struct Host {
    int space = -1;  // descriptors of the namespace, and of the switch's end of the interface
    int port = -1;
    std::atomic<bool> is_cut = false;
    std::array<std::atomic<bool>, kHostsMax> is_cut_to = {};
  };

  void run();

  std::vector<std::unique_ptr<Host>> hosts_;
  std::atomic<int> delay_ms_ = 0;
  std::atomic<int> lost_of_1000_ = 0;
  std::atomic<bool> closing_ = false;
  std::thread switch_;
};

}  // namespace tessera::testing
