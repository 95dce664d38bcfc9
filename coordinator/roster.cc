#include "coordinator/roster.h"

#include <algorithm>
#include <string>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"

namespace tessera {

std::optional<std::size_t> Roster::rank_of(NodeId node) const {
  const auto place = std::find(nodes_.begin(), nodes_.end(), node);
  if (place == nodes_.end()) return std::nullopt;
  return static_cast<std::size_t>(place - nodes_.begin());
}

bool Roster::hosts() const {
  return !ready_.empty() && std::find(ready_.begin(), ready_.end(), false) == ready_.end();
}

void Roster::has_world(std::size_t rank) {
  invariant(rank < ready_.size(), "servers have ranks of their world");
  ready_[rank] = true;
}

std::vector<NodeId> Roster::listeners() const {
  std::vector<NodeId> listeners = nodes_;
  if (guest_) listeners.push_back(guest_->node);
  return listeners;
}

bool Roster::needs(NodeId node) const {
  return rank_of(node) || is_guest(node) || (leaver_ && leaver_->node == node);
}

bool Roster::cannot_lose(NodeId node) const {
  return rank_of(node) || (leaver_ && leaver_->node == node && !leaver_->until);
}

void Roster::invite(NodeId node) {
  invariant(!guest_ && !rank_of(node), "one server at a time gets ready, which takes no part yet");
  guest_ = Guest{node};
}

void Roster::guest_is_ready() {
  invariant(guest_.has_value(), "a guest that gets ready was invited");
  guest_->is_ready = true;
}

void Roster::guest_awaits(std::vector<NodeId> unheard) {
  invariant(guest_.has_value(), "only a guest that was invited waits for others");
  guest_->unheard = std::move(unheard);
}

void Roster::release_leaver(Nanoseconds until) {
  invariant(leaver_ && !leaver_->until, "a server that leaves is released once");
  leaver_->until = until;
}

void Roster::change(const v1::SectorMap& map) {
  std::vector<NodeId> nodes;
  for (const std::uint64_t node : map.nodes()) nodes.push_back(NodeId{node});
  for (const NodeId node : std::exchange(nodes_, std::move(nodes))) {
    if (rank_of(node)) continue;
    invariant(!leaver_, "one server at a time leaves");
    leaver_ = Leaver{node, std::nullopt};
    subscriptions_.erase(node);
    ++left_;
  }
  if (map.newcomers() > 0) {
    invariant(map.newcomers() == 1 && is_guest(nodes_.back()), "who begins to take part was a guest");
    *subscriptions_[nodes_.back()].mutable_all() = map.subscriptions();
    guest_.reset();
    ++joined_;
  }
  ready_.assign(nodes_.size(), true);
}

std::vector<NodeId> Roster::restart(std::vector<NodeId> nodes) {
  std::vector<NodeId> before = listeners();
  nodes_ = std::move(nodes);
  ready_.assign(nodes_.size(), false);
  guest_.reset();
  leaver_.reset();
  unfit_.clear();
  std::erase_if(before, [&](NodeId node) { return rank_of(node).has_value(); });
  return before;
}

void Roster::subscribe(NodeId node, v1::Subscriptions subscriptions) {
  subscriptions_[node] = std::move(subscriptions);
}

v1::Subscriptions Roster::all_subscriptions() const {
  v1::Subscriptions all;
  std::set<std::string> known;
  for (const auto& [node, subscriptions] : subscriptions_) {
    for (const v1::Subscription& subscription : subscriptions.all()) {
      if (all.all_size() >= kSubscriptionsMax || !known.insert(subscription.SerializeAsString()).second)
        continue;
      *all.add_all() = subscription;
    }
  }
  return all;
}

v1::Subscriptions Roster::take_subscriptions() {
  v1::Subscriptions all = all_subscriptions();
  subscriptions_.clear();
  return all;
}

}  // namespace tessera
