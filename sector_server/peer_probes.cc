#include "sector_server/peer_probes.h"

#include <algorithm>
#include <cstddef>

namespace tessera {
namespace {

// Beyond this, all are forgotten: then they count as silent until they are heard again.
constexpr std::size_t kPeersMax = 4096;

// Of a world with more servers, all but those that are awaited are too many to be asked.
constexpr std::size_t kOthersMax = 64;

// The first question has just been asked.
constexpr std::uint32_t kAskedMin = 2;

}  // namespace

void PeerProbes::heard(NodeId peer) {
  if (peers_.size() >= kPeersMax && !peers_.contains(peer)) peers_.clear();
  peers_[peer] = {.in_contact = true, .asked = 0};
}

void PeerProbes::lost(NodeId peer) {
  const auto known = peers_.find(peer);
  if (known != peers_.end()) known->second.in_contact = false;
}

std::vector<NodeId> PeerProbes::look(const std::optional<Wait>& wait) {
  const bool goes_on = wait && round_ == wait->round;
  round_ = wait ? std::optional(wait->round) : std::nullopt;
  if (!goes_on) {
    for (auto& [node, peer] : peers_) peer.asked = 0;
    return {};
  }
  std::vector<NodeId> asked = wait->peers;
  const bool is_missed = std::ranges::any_of(asked, [this](NodeId node) { return peers_[node].asked > 0; });
  if (is_missed && wait->others.size() <= kOthersMax)
    asked.insert(asked.end(), wait->others.begin(), wait->others.end());
  for (const NodeId node : asked) ++peers_[node].asked;
  return asked;
}

bool PeerProbes::any_unheard() const {
  return std::ranges::any_of(peers_, [](const auto& entry) { return entry.second.asked >= kAskedMin; });
}

void PeerProbes::write(v1::Report& report) const {
  for (const auto& [node, peer] : peers_) {
    if (peer.asked < kAskedMin) continue;
    v1::Unheard& unheard = *report.add_unheard();
    unheard.set_node(node.value);
    unheard.set_waited_ms((peer.asked - 1) * static_cast<std::uint64_t>(kEvery.count()));
    unheard.set_silent(!peer.in_contact);
  }
}

}  // namespace tessera
