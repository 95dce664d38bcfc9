// The state of the exchange between this process and one peer, which delivers every message exactly once
// while both live, whatever the connection between them does. Pure logic: takes packets and events, returns
// packets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "transport/link.h"

namespace tessera {

// Distinguishes a process from its predecessor at the same address; drawn at random at start, never 0.
using Session = std::uint64_t;

// Larger payloads travel in parts of this size: with its header, a part fits into one datagram.
inline constexpr std::size_t kPartBytes = 60 * 1024;
// Larger messages are not accepted.
inline constexpr std::uint64_t kMessageBytesMax = std::uint64_t{4} << 30;
// The number of unacknowledged bytes to one peer; each end chooses within this range. If it exceeds the
// receiver's socket buffer, throughput breaks down; smaller values cost nothing at low latency.
inline constexpr std::size_t kWindowBytesMin = 256 * 1024;
inline constexpr std::size_t kWindowBytesMax = 1024 * 1024;

// A part of a message, or a control packet between two links: proto/cluster.idl defines each field. `payload`
// is a view of the sender's memory, valid until its next call.
struct Packet {
  Session from_session = 0;
  Session to_session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t acknowledged = 0;
  std::uint64_t rest = 0;
  bool sync = false;
  bool welcome = false;
  std::string_view payload;
};

// Both directions between this process and one peer.
//
// The connection below may come and go. While it stands it keeps order and loses nothing; when it breaks, any
// packet may be lost, even if one end does not notice the break. So each new connection starts with a
// question (sync) and an answer (welcome) about what has arrived, and the sender keeps what has not. A
// receiver that sees a gap, or a new connection from a known peer, reports it unasked.
//
// When the peer's process is replaced by another at the same address, messages sent before the loss was
// noticed are dropped, because it is unknown which of them the old process acted upon. For one thread.
class PeerStream {
 public:
  PeerStream(NodeId peer, Session self, std::size_t window_bytes = kWindowBytesMin)
      : peer_(peer), self_(self), window_bytes_(window_bytes) {}

  NodeId peer() const { return peer_; }

  // Appends a message. Never fails; messages that cannot be sent now are kept.
  void push(std::string payload);

  // The connection to the peer has come up (possibly again, without a visible break), or is lost.
  void connected();
  void disconnected();

  // A connection from the peer has come up.
  void heard_of();

  // The process of `session` has been silent for too long; its connections may still exist.
  void fell_silent(Session session);

  // Processes a packet from the peer and appends the message that it completes, if any. Packets to or from
  // other sessions are ignored, and so are those that no correct peer sends; the first of these is reported
  // on standard error.
  void accept(const Packet& packet, std::vector<Delivery>& deliveries);

  // The next packet to send, if there is one now. Call sent() once it has been sent; otherwise the same
  // packet is returned again.
  std::optional<Packet> next() const;
  void sent(const Packet& packet);

  // For messages that go to the peer by another way and keep their order with those that go by this one.
  // Whether the peer's process is connected, has answered and is not lost: what is sent now is for it and for
  // no successor. Then which session it is, the number of the last packet of what was pushed, and of the last
  // one that arrived.
  bool is_open() const { return connected_ && open_ && !before_loss_; }
  Session session() const { return session_; }
  std::uint64_t pushed() const { return next_sequence_ - 1; }
  std::uint64_t received() const { return received_sequence_; }
  // The peer's process has said something there.
  void heard_elsewhere();
  // A packet that says nothing new.
  Packet acknowledgement() const;

  // Drops all messages kept for the peer's current process and ignores that process from now on; a successor
  // at its address is accepted.
  void forget();

  // True once after a known peer has gone, fallen silent or been replaced by another process.
  bool take_loss();

 private:
  struct Outgoing {
    std::string payload;
    std::uint64_t first_sequence = 0;
    // Position of the payload in the stream of all bytes.
    std::uint64_t first_byte = 0;
  };

  static std::uint64_t part_count(const std::string& payload);
  void take_acknowledgement(std::uint64_t sequence);
  void rewind();
  void replaced_by(Session session);
  void start_over();
  void note_loss();
  void accept_part(const Packet& packet, std::vector<Delivery>& deliveries);
  void complain(const char* what, std::uint64_t number);

  NodeId peer_;
  Session self_;
  std::size_t window_bytes_;
  // 0: not known yet.
  Session session_ = 0;
  std::vector<Session> dead_sessions_;

  bool connected_ = false;
  // The peer has answered on this connection.
  bool open_ = false;
  bool lost_ = false;
  bool owes_sync_ = false;
  bool owes_welcome_ = false;

  // Messages that have not been acknowledged, sent or not, in order; the part to be sent next is in the
  // message with index `cursor_`.
  std::deque<Outgoing> outgoing_;
  std::size_t cursor_ = 0;
  std::uint64_t next_sequence_ = 1;
  std::uint64_t next_byte_ = 0;
  std::uint64_t sent_sequence_ = 0;
  // The furthest position of the sender, which may be beyond the last rewind.
  std::uint64_t sent_sequence_max_ = 0;
  std::uint64_t sent_bytes_ = 0;
  std::uint64_t acknowledged_sequence_ = 0;
  std::uint64_t acknowledged_bytes_ = 0;
  // From the loss of the peer until the same process reappears: the number of messages at the front of
  // `outgoing_` that were sent before the loss.
  std::optional<std::size_t> before_loss_;

  std::uint64_t received_sequence_ = 0;
  std::string partial_;
  std::uint64_t partial_rest_ = 0;
  std::uint64_t unacknowledged_parts_ = 0;
  std::uint64_t unacknowledged_bytes_ = 0;
  // The gap that has already been reported.
  std::uint64_t complained_ = 0;
  bool has_reported_ = false;  // a packet that no correct peer sends
};

}  // namespace tessera
