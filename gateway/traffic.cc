#include "gateway/traffic.h"

namespace tessera {
namespace {

// Without the port, so that all connections of a host count together.
std::string host_of(const std::string& peer) { return peer.substr(0, peer.rfind(':')); }

}  // namespace

bool Traffic::enter(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  std::size_t& of_client = by_client_[host_of(peer)];
  if (under_way_ >= limits_.calls || of_client >= limits_.calls_per_client) {
    ++refused_;
    if (of_client == 0) by_client_.erase(host_of(peer));
    return false;
  }
  ++of_client;
  ++under_way_;
  return true;
}

void Traffic::leave(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  const auto client = by_client_.find(host_of(peer));
  if (--client->second == 0) by_client_.erase(client);
  --under_way_;
}

std::size_t Traffic::under_way() const {
  const std::lock_guard lock(mutex_);
  return under_way_;
}

std::size_t Traffic::clients() const {
  const std::lock_guard lock(mutex_);
  return by_client_.size();
}

}  // namespace tessera
