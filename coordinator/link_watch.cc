#include "coordinator/link_watch.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

// What a server has answered takes less time than this to be there.
constexpr std::chrono::milliseconds kAnswerMax{500};
// Servers notice one cut at different times: so long after the first it is decided whom to drop.
constexpr std::chrono::milliseconds kGather{250};
constexpr std::size_t kKnownMax = 4096;  // then all are forgotten, and found again

bool is_among(const std::vector<NodeId>& nodes, NodeId node) {
  return std::ranges::find(nodes, node) != nodes.end();
}

}  // namespace

void LinkWatch::on_report(NodeId from, const std::vector<v1::Unheard>& unheard, Nanoseconds now) {
  for (auto& [link, complaint] : complaints_) {
    if (link.awaited == from && !complaint.waited_when_heard) complaint.waited_when_heard = complaint.waited;
  }
  std::set<NodeId> awaited;
  for (const v1::Unheard& one : unheard) {
    awaited.insert(NodeId{one.node()});
    Complaint& complaint = complaints_[{from, NodeId{one.node()}}];
    complaint.waited = std::chrono::milliseconds(one.waited_ms());
    complaint.silent = one.silent();
    if (!due_ && is_cut(complaint)) due_ = now + kGather;
  }
  std::erase_if(complaints_, [&](const auto& entry) {
    return entry.first.waits == from && !awaited.contains(entry.first.awaited);
  });
}

bool LinkWatch::lasts(const Complaint& complaint, Nanoseconds patience) const {
  return complaint.waited >= patience && complaint.waited_when_heard &&
         complaint.waited >= *complaint.waited_when_heard + kAnswerMax;
}

bool LinkWatch::is_cut(const Complaint& complaint) const {
  return lasts(complaint, complaint.silent ? patience_ : std::max(patience_, long_patience_));
}

bool LinkWatch::is_doubtful(NodeId node) const {
  return std::ranges::any_of(complaints_, [&](const auto& entry) {
    const auto& [link, complaint] = entry;
    return (link.waits == node || link.awaited == node) && lasts(complaint, Nanoseconds::zero());
  });
}

std::vector<LinkWatch::Dropped> LinkWatch::take_dropped(Nanoseconds now) {
  if (!due_ || now < *due_) return {};
  due_.reset();
  // Unless it has turned out otherwise meanwhile.
  if (std::ranges::none_of(complaints_, [this](const auto& entry) { return is_cut(entry.second); }))
    return {};
  std::vector<CutLink> links;
  for (const auto& [link, complaint] : complaints_) {
    if (lasts(complaint, Nanoseconds::zero())) links.push_back(link);
  }
  std::vector<Dropped> dropped;
  for (const NodeId node : servers_to_drop(links)) {
    Dropped& one = dropped.emplace_back();
    one.node = node;
    for (const CutLink& link : links) {
      if (link.waits != node && link.awaited != node) continue;
      const NodeId other = link.waits == node ? link.awaited : link.waits;
      if (!is_among(one.unheard_by, other)) one.unheard_by.push_back(other);
      one.waited = std::max(one.waited, complaints_.at(link).waited);
    }
  }
  if (known_.size() + links.size() > kKnownMax) known_.clear();
  known_.insert(links.begin(), links.end());
  return dropped;
}

std::vector<NodeId> LinkWatch::apart(const std::vector<NodeId>& nodes) const {
  std::vector<CutLink> links;
  for (const CutLink& link : known_) {
    if (is_among(nodes, link.waits) && is_among(nodes, link.awaited)) links.push_back(link);
  }
  return servers_to_drop(links);
}

void LinkWatch::have_met(NodeId node, const std::vector<NodeId>& others) {
  std::erase_if(known_, [&](const CutLink& link) {
    return (link.waits == node && is_among(others, link.awaited)) ||
           (link.awaited == node && is_among(others, link.waits));
  });
}

void LinkWatch::restart() {
  complaints_.clear();
  due_.reset();
}

}  // namespace tessera
