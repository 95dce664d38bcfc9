// What goes through a gateway, counted. Written and read by any thread.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

namespace tessera {

struct GatewayLimits {
  std::size_t calls = 0;             // under way at a time
  std::size_t calls_per_client = 0;  // of one address
};

class Traffic {
 public:
  enum Service { kCoordinator, kStreams };
  static constexpr std::array<const char*, 2> kServices = {"Tessera", "Streams"};
  struct Counts {
    std::atomic<std::uint64_t> calls = 0;
    std::atomic<std::uint64_t> requests = 0;  // messages of clients
    std::atomic<std::uint64_t> request_bytes = 0;
    std::atomic<std::uint64_t> replies = 0;
    std::atomic<std::uint64_t> reply_bytes = 0;
  };

  explicit Traffic(const GatewayLimits& limits) : limits_(limits) {}

  // Whether one more call may begin; it ends with leave(). `peer` as gRPC writes it: "ipv4:10.0.0.1:4321".
  bool enter(const std::string& peer);
  void leave(const std::string& peer);

  std::size_t under_way() const;
  std::size_t clients() const;  // addresses with calls under way
  std::uint64_t refused() const { return refused_; }
  Counts& of(Service service) { return counts_[service]; }
  const Counts& of(Service service) const { return counts_[service]; }

 private:
  const GatewayLimits limits_;
  std::array<Counts, kServices.size()> counts_;
  std::atomic<std::uint64_t> refused_ = 0;
  mutable std::mutex mutex_;  // guards the following
  std::size_t under_way_ = 0;
  absl::flat_hash_map<std::string, std::size_t> by_client_;
};

}  // namespace tessera
