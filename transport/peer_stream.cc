#include "transport/peer_stream.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace tessera {
namespace {

// Without traffic in the other direction to piggyback on, an acknowledgement is sent after this much: often
// enough that the sender's window never closes and the sender does not keep many small messages.
constexpr std::uint64_t kAcknowledgeBytes = kWindowBytesMin / 4;
constexpr std::uint64_t kAcknowledgeParts = 64;
constexpr std::uint64_t kReservedMax = std::uint64_t{64} << 20;  // bytes

}  // namespace

std::uint64_t PeerStream::part_count(const std::string& payload) {
  return std::max<std::uint64_t>(1, (payload.size() + kPartBytes - 1) / kPartBytes);
}

void PeerStream::push(std::string payload) {
  const std::uint64_t parts = part_count(payload);
  const std::uint64_t bytes = payload.size();
  outgoing_.push_back({std::move(payload), next_sequence_, next_byte_});
  next_sequence_ += parts;
  next_byte_ += bytes;
}

void PeerStream::connected() {
  connected_ = true;
  open_ = false;
  owes_sync_ = true;
}

void PeerStream::disconnected() {
  if (!connected_) return;
  connected_ = false;
  open_ = false;
  note_loss();
}

void PeerStream::fell_silent(Session session) {
  if (session == session_) note_loss();
}

void PeerStream::note_loss() {
  if (session_ == 0 || before_loss_) return;
  lost_ = true;
  before_loss_ = outgoing_.size();
}

void PeerStream::heard_of() {
  if (session_ != 0) owes_welcome_ = true;
  // The peer's acknowledgements may have been lost as well.
  if (connected_) owes_sync_ = true;
}

bool PeerStream::take_loss() { return std::exchange(lost_, false); }

std::optional<Packet> PeerStream::next() const {
  if (!connected_) return std::nullopt;
  Packet packet{.from_session = self_,
                .to_session = session_,
                .acknowledged = received_sequence_,
                .sync = owes_sync_,
                .welcome = owes_welcome_ && session_ != 0};
  if (owes_sync_) {
    // The process that listens now need not be the same as before.
    if (!packet.welcome) packet.to_session = 0;
    return packet;
  }
  if (packet.welcome) return packet;
  if (open_ && cursor_ < outgoing_.size()) {
    const Outgoing& message = outgoing_[cursor_];
    const std::uint64_t begin = (sent_sequence_ + 1 - message.first_sequence) * kPartBytes;
    const std::uint64_t size = std::min<std::uint64_t>(kPartBytes, message.payload.size() - begin);
    const std::uint64_t under_way = sent_bytes_ - acknowledged_bytes_;
    if (under_way == 0 || under_way + size <= window_bytes_) {
      packet.sequence = sent_sequence_ + 1;
      packet.payload = std::string_view(message.payload).substr(begin, size);
      packet.rest = message.payload.size() - begin - size;
      return packet;
    }
  }
  if (unacknowledged_bytes_ >= kAcknowledgeBytes || unacknowledged_parts_ >= kAcknowledgeParts) return packet;
  return std::nullopt;
}

void PeerStream::heard_elsewhere() {
  if (connected_) before_loss_.reset();
}

Packet PeerStream::acknowledgement() const {
  return {.from_session = self_, .to_session = session_, .acknowledged = received_sequence_};
}

void PeerStream::sent(const Packet& packet) {
  if (packet.sync) owes_sync_ = false;
  if (packet.welcome) owes_welcome_ = false;
  if (packet.to_session != 0) {
    unacknowledged_bytes_ = 0;
    unacknowledged_parts_ = 0;
  }
  if (packet.sequence == 0) return;
  sent_sequence_ = packet.sequence;
  sent_sequence_max_ = std::max(sent_sequence_max_, sent_sequence_);
  sent_bytes_ += packet.payload.size();
  if (packet.rest == 0) ++cursor_;
}

void PeerStream::accept(const Packet& packet, std::vector<Delivery>& deliveries) {
  if (packet.to_session != self_ && !(packet.to_session == 0 && packet.sync)) return;
  if (std::find(dead_sessions_.begin(), dead_sessions_.end(), packet.from_session) != dead_sessions_.end())
    return;
  if (packet.from_session != session_) replaced_by(packet.from_session);
  // Without a connection to it, this may be its last message.
  if (connected_) before_loss_.reset();
  if (packet.to_session != 0) {
    take_acknowledgement(packet.acknowledged);
    if (packet.welcome) {
      rewind();
      // An answer that was in transit before the connection broke does no harm: packets sent because of it
      // are dropped as repetitions, and lost ones are sent again after the pending answer.
      open_ = connected_;
    }
    if (packet.sequence != 0) accept_part(packet, deliveries);
  }
  if (packet.sync) {
    owes_welcome_ = true;
    // The peer has restarted, so it may have missed our question.
    if (connected_ && !open_) owes_sync_ = true;
  }
}

void PeerStream::accept_part(const Packet& packet, std::vector<Delivery>& deliveries) {
  if (packet.sequence <= received_sequence_) return;
  if (packet.sequence > received_sequence_ + 1) {
    if (complained_ != received_sequence_ + 1) owes_welcome_ = true;
    complained_ = received_sequence_ + 1;
    return;
  }
  if (packet.payload.size() > kPartBytes || packet.rest > kMessageBytesMax)
    return complain("a message is too large", packet.rest);
  if (partial_rest_ != 0 && partial_rest_ != packet.payload.size() + packet.rest)
    return complain("a message changes its size in transit", packet.sequence);
  received_sequence_ = packet.sequence;
  ++unacknowledged_parts_;
  unacknowledged_bytes_ += packet.payload.size();
  // What is said of the rest is believed only so far.
  if (partial_.empty()) partial_.reserve(packet.payload.size() + std::min(packet.rest, kReservedMax));
  partial_.append(packet.payload);
  partial_rest_ = packet.rest;
  if (packet.rest == 0) deliveries.push_back({peer_, std::exchange(partial_, {})});
}

void PeerStream::take_acknowledgement(std::uint64_t sequence) {
  if (sequence <= acknowledged_sequence_) return;
  if (sequence > sent_sequence_max_) return complain("it acknowledges what was never sent", sequence);
  acknowledged_sequence_ = sequence;
  while (!outgoing_.empty() && outgoing_.front().first_sequence <= sequence) {
    const Outgoing& front = outgoing_.front();
    const std::uint64_t parts_done = sequence + 1 - front.first_sequence;
    if (parts_done < part_count(front.payload)) {
      acknowledged_bytes_ = front.first_byte + parts_done * kPartBytes;
      break;
    }
    acknowledged_bytes_ = front.first_byte + front.payload.size();
    outgoing_.pop_front();
    if (cursor_ > 0) --cursor_;
    if (before_loss_.value_or(0) > 0) --*before_loss_;
  }
  if (sent_sequence_ < acknowledged_sequence_) rewind();
}

void PeerStream::rewind() {
  cursor_ = 0;
  sent_sequence_ = acknowledged_sequence_;
  sent_bytes_ = acknowledged_bytes_;
}

void PeerStream::replaced_by(Session session) {
  if (session_ != 0) {
    dead_sessions_.push_back(session_);
    // If we had not noticed that the old process was gone, all messages were meant for it.
    note_loss();
    outgoing_.erase(outgoing_.begin(), outgoing_.begin() + static_cast<std::ptrdiff_t>(*before_loss_));
  }
  session_ = session;
  start_over();
}

void PeerStream::forget() {
  if (session_ != 0) dead_sessions_.push_back(session_);
  session_ = 0;
  lost_ = false;
  outgoing_.clear();
  start_over();
}

void PeerStream::start_over() {
  std::deque<Outgoing> kept = std::exchange(outgoing_, {});
  next_sequence_ = 1;
  next_byte_ = 0;
  sent_sequence_max_ = 0;
  acknowledged_sequence_ = 0;
  acknowledged_bytes_ = 0;
  before_loss_.reset();
  for (Outgoing& message : kept) push(std::move(message.payload));
  rewind();
  open_ = false;
  owes_sync_ = connected_;
  owes_welcome_ = false;
  received_sequence_ = 0;
  partial_ = {};
  partial_rest_ = 0;
  unacknowledged_parts_ = 0;
  unacknowledged_bytes_ = 0;
  complained_ = 0;
}

void PeerStream::complain(const char* what, std::uint64_t number) {
  if (std::exchange(has_reported_, true)) return;
  std::fprintf(stderr, "tessera: a packet from node %llx is ignored: %s (%llu)\n",
               static_cast<unsigned long long>(peer_.value), what, static_cast<unsigned long long>(number));
}

}  // namespace tessera
