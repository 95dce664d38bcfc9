#include "sector_server/round_exchange.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "lpss/base/invariant.h"
#include "lpss/model/limits.h"
#include "proto/wire.h"

namespace tessera {
namespace {

// A server is some rounds ahead of the others.
constexpr std::size_t kRoundsAheadMax = 65'536;

bool is_in(const std::vector<NodeId>& nodes, NodeId node) {
  return std::find(nodes.begin(), nodes.end(), node) != nodes.end();
}

const Seams* seams_in(const RoundMessage& message) {
  const auto* seams = std::get_if<std::shared_ptr<const Seams>>(&message);
  return seams != nullptr ? seams->get() : nullptr;
}

}  // namespace

RoundExchange::RoundExchange(std::uint64_t world, NodeId node, std::vector<NodeId> nodes, Send send)
    : world_(world), node_(node), send_(std::move(send)) {
  change_nodes(std::move(nodes));
}

void RoundExchange::change_nodes(std::vector<NodeId> nodes) {
  nodes_ = std::move(nodes);
  self_ = static_cast<Rank>(std::find(nodes_.begin(), nodes_.end(), node_) - nodes_.begin());
}

void RoundExchange::welcome(NodeId guest) {
  if (is_in(nodes_, guest) || is_in(guests_, guest)) return;
  if (guests_.size() == kServersMax) guests_.erase(guests_.begin());
  guests_.push_back(guest);
}

absl::Status RoundExchange::take(NodeId from, v1::Round round, Tick done) {
  if (!is_in(nodes_, from) && !is_in(guests_, from))
    return absl::InvalidArgumentError(
        absl::StrCat("a round from ", from.value, ", which is not a server of this world"));
  // It may be any number of ticks ahead: a world at rest needs no messages, so its servers proceed at their
  // own pace.
  if (round.tick() <= done) {
    return absl::InternalError(
        absl::StrCat("a message of tick ", round.tick(), " arrived after tick ", done));
  }
  const Key key{round.tick(), round.map_epoch(), round.number()};
  if (inboxes_.size() >= kRoundsAheadMax && !inboxes_.contains(key)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("messages of ", kRoundsAheadMax, " rounds already wait for their turn"));
  }
  if (!inboxes_[key].try_emplace(from.value, std::move(*round.mutable_body())).second)
    return absl::InternalError(absl::StrCat("a message of tick ", round.tick(), " arrived twice"));
  return absl::OkStatus();
}

void RoundExchange::send(const Round& round, const Key& key) {
  invariant(round.to.size() == nodes_.size(), "a round has a place for each server");
  std::string packed;
  const RoundMessage* before = nullptr;
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round.to[rank]) continue;
    // Where all servers get the same seams, these are packed once.
    const Seams* const seams = seams_in(*round.to[rank]);
    const bool same = before != nullptr && seams != nullptr && seams == seams_in(*before);
    if (!same) packed = pack(*round.to[rank]);
    before = &*round.to[rank];
    traffic_.sent[before->index()].add(packed.size());
    v1::ClusterMessage message;
    v1::Round& letter = *message.mutable_round();
    letter.set_world(world_);
    letter.set_tick(key.tick);
    letter.set_number(key.number);
    letter.set_map_epoch(key.map_epoch);
    letter.set_body(packed);
    send_(nodes_[rank], message);
  }
}

bool RoundExchange::has_all(const Round& round, const Key& key) const {
  const auto inbox = inboxes_.find(key);
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round.from[rank]) continue;
    if (inbox == inboxes_.end() || !inbox->second.contains(nodes_[rank].value)) return false;
  }
  return true;
}

std::vector<NodeId> RoundExchange::missing(const Round& round, const Key& key) const {
  const auto inbox = inboxes_.find(key);
  std::vector<NodeId> nodes;
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round.from[rank]) continue;
    if (inbox == inboxes_.end() || !inbox->second.contains(nodes_[rank].value)) nodes.push_back(nodes_[rank]);
  }
  return nodes;
}

absl::StatusOr<std::vector<std::optional<RoundMessage>>> RoundExchange::collect(Round& round, const Key& key,
                                                                                const TickMachine& machine) {
  invariant(takes_part() && has_all(round, key), "a round goes on once all has arrived");
  std::vector<std::optional<RoundMessage>> messages(nodes_.size());
  messages[self_] = std::move(round.to[self_]);
  const auto inbox = inboxes_.find(key);
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round.from[rank]) continue;
    const std::string& bytes = inbox->second.at(nodes_[rank].value);
    absl::StatusOr<RoundMessage> message = unpack_round(bytes);
    if (!message.ok()) return message.status();
    if (!machine.awaits(*message)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "node ", absl::Hex(nodes_[rank].value), " sent a message of another kind than that of its round"));
    }
    traffic_.received[message->index()].add(bytes.size());
    messages[rank] = std::move(*message);
  }
  return messages;
}

RoundTraffic RoundExchange::Traffic::all_sent() const {
  RoundTraffic sum;
  for (const RoundTraffic& round : sent) {
    sum.messages += round.messages;
    sum.bytes += round.bytes;
  }
  return sum;
}

}  // namespace tessera
