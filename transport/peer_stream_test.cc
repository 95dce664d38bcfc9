#include "transport/peer_stream.h"

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace tessera {
namespace {

constexpr NodeId kA{1};
constexpr NodeId kB{2};

// A packet on the wire, which owns its payload.
struct Sent {
  Packet packet;
  std::string payload;

  Packet view() const {
    Packet result = packet;
    result.payload = payload;
    return result;
  }
};

// One process: its stream to the other, and the packets on the wire to it.
struct End {
  End(NodeId other, Session session) : stream(other, session) {}

  void pump() {
    while (const std::optional<Packet> packet = stream.next()) {
      wire.push_back({*packet, std::string(packet->payload)});
      stream.sent(*packet);
    }
  }

  std::vector<std::string> got() const {
    std::vector<std::string> result;
    for (const Delivery& delivery : deliveries) result.push_back(delivery.payload);
    return result;
  }

  PeerStream stream;
  std::deque<Sent> wire;
  std::vector<Delivery> deliveries;
};

void carry_one(End& from, End& to) {
  const Sent sent = std::move(from.wire.front());
  from.wire.pop_front();
  to.stream.accept(sent.view(), to.deliveries);
}

// Exchanges packets until neither has any left.
void settle(End& a, End& b) {
  for (;;) {
    a.pump();
    b.pump();
    if (a.wire.empty() && b.wire.empty()) return;
    while (!a.wire.empty()) carry_one(a, b);
    while (!b.wire.empty()) carry_one(b, a);
  }
}

void connect(End& a, End& b) {
  a.stream.connected();
  b.stream.heard_of();
  b.stream.connected();
  a.stream.heard_of();
}

void disconnect(End& a, End& b) {
  for (End* end : {&a, &b}) {
    end->stream.disconnected();
    end->wire.clear();
  }
}

// A payload in which every part is different.
std::string filled(std::size_t size, char first) {
  std::string result(size, first);
  for (std::size_t i = 0; i < size; i += kPartBytes / 2) result[i] = static_cast<char>(i / kPartBytes);
  return result;
}

TEST(PeerStream, QueuesUntilThePeerIsThere) {
  End a(kB, 11);
  End b(kA, 22);
  a.stream.push("one");
  a.stream.push("");
  settle(a, b);
  EXPECT_TRUE(b.deliveries.empty());
  connect(a, b);
  settle(a, b);
  EXPECT_EQ(b.got(), (std::vector<std::string>{"one", ""}));
  EXPECT_EQ(b.deliveries[0].from, kA);
  EXPECT_FALSE(a.stream.take_loss());
}

TEST(PeerStream, CutsLargeMessagesAndKeepsToTheWindow) {
  End a(kB, 11);
  End b(kA, 22);
  connect(a, b);
  settle(a, b);
  std::vector<std::string> messages;
  for (std::size_t size :
       {kPartBytes - 1, kPartBytes, kPartBytes + 1, 5 * kWindowBytesMin + 7, std::size_t{3}}) {
    messages.push_back(filled(size, 'a'));
    a.stream.push(messages.back());
  }
  a.pump();
  std::size_t under_way = 0;
  for (const Sent& sent : a.wire) {
    EXPECT_LE(sent.payload.size(), kPartBytes);
    under_way += sent.payload.size();
  }
  EXPECT_LE(under_way, kWindowBytesMin);
  EXPECT_GE(under_way, kWindowBytesMin / 2);
  settle(a, b);
  EXPECT_TRUE(b.got() == messages);
}

TEST(PeerStream, OneWayTrafficIsAcknowledged) {
  End a(kB, 11);
  End b(kA, 22);
  connect(a, b);
  settle(a, b);
  for (int i = 0; i < 10'000; ++i) {
    a.stream.push(std::string(1000, 'x'));
    a.pump();
    while (!a.wire.empty()) carry_one(a, b);
    b.pump();
    while (!b.wire.empty()) carry_one(b, a);
  }
  EXPECT_EQ(b.deliveries.size(), 10'000u);
}

TEST(PeerStream, ABrokenConnectionLosesNothing) {
  End a(kB, 11);
  End b(kA, 22);
  connect(a, b);
  settle(a, b);
  a.stream.push("before");
  settle(a, b);
  a.stream.push("lost on the way");
  a.pump();
  disconnect(a, b);
  a.stream.push("while down");
  EXPECT_TRUE(a.stream.take_loss());
  EXPECT_FALSE(a.stream.take_loss());
  connect(a, b);
  settle(a, b);
  EXPECT_EQ(b.got(), (std::vector<std::string>{"before", "lost on the way", "while down"}));
  EXPECT_FALSE(a.stream.take_loss());
}

TEST(PeerStream, ASuccessorGetsOnlyWhatWasSentAfterTheLoss) {
  End a(kB, 11);
  auto b = std::make_unique<End>(kA, 22);
  connect(a, *b);
  settle(a, *b);
  a.stream.push("acted upon or not");
  a.pump();
  disconnect(a, *b);
  EXPECT_TRUE(a.stream.take_loss());
  a.stream.push("for the next");
  End c(kA, 33);
  connect(a, c);
  settle(a, c);
  EXPECT_EQ(c.got(), std::vector<std::string>{"for the next"});
  EXPECT_FALSE(a.stream.take_loss());
  // The old process was only paused; its messages are ignored now.
  b->stream.push("from beyond");
  b->stream.connected();
  b->pump();
  while (!b->wire.empty()) carry_one(*b, a);
  settle(a, c);
  EXPECT_TRUE(a.deliveries.empty());
}

TEST(PeerStream, APeerThatFellSilentIsLostUntilItSpeaks) {
  End a(kB, 11);
  End b(kA, 22);
  connect(a, b);
  settle(a, b);
  a.stream.fell_silent(33);
  EXPECT_FALSE(a.stream.take_loss());
  a.stream.push("one");
  a.stream.fell_silent(22);
  a.stream.fell_silent(22);
  EXPECT_TRUE(a.stream.take_loss());
  a.stream.push("two");
  b.stream.push("still here");
  settle(a, b);
  EXPECT_EQ(b.got(), (std::vector<std::string>{"one", "two"}));
  EXPECT_FALSE(a.stream.take_loss());
  a.stream.fell_silent(22);
  a.stream.push("three");
  End c(kA, 33);
  connect(a, c);
  settle(a, c);
  EXPECT_EQ(c.got(), std::vector<std::string>{"three"});
}

TEST(PeerStream, AnUnnoticedReplacementIsALoss) {
  End a(kB, 11);
  End b(kA, 22);
  connect(a, b);
  settle(a, b);
  a.stream.push(filled(3 * kPartBytes, 'a'));
  a.pump();
  a.wire.clear();
  End c(kA, 33);
  connect(a, c);
  settle(a, c);
  EXPECT_TRUE(a.stream.take_loss());
  EXPECT_TRUE(c.deliveries.empty());
  a.stream.push("hello");
  c.stream.push("hello too");
  settle(a, c);
  EXPECT_EQ(c.got(), std::vector<std::string>{"hello"});
  EXPECT_EQ(a.got(), std::vector<std::string>{"hello too"});
}

TEST(PeerStream, AForgottenProcessIsIgnoredItsSuccessorIsNot) {
  End a(kB, 11);
  End b(kA, 22);
  connect(a, b);
  settle(a, b);
  disconnect(a, b);
  a.stream.push("never arrives");
  a.stream.forget();
  connect(a, b);
  b.stream.push("let me in");
  settle(a, b);
  EXPECT_TRUE(a.deliveries.empty());
  EXPECT_TRUE(b.deliveries.empty());
  a.stream.push("for the next");
  disconnect(a, b);
  a.stream.take_loss();
  End c(kA, 33);
  connect(a, c);
  settle(a, c);
  EXPECT_EQ(c.got(), std::vector<std::string>{"for the next"});
}

// Breaks one direction: packets on the wire are lost from some point on. The sender may or may not notice;
// the receiver's DDS rediscovers the sender and may deliver earlier packets again.
void break_wire(End& from, End& to, std::mt19937_64& random) {
  const std::size_t kept = random() % (from.wire.size() + 1);
  for (std::size_t i = 0; i < kept; ++i) {
    const Sent sent = from.wire[i];
    to.stream.accept(sent.view(), to.deliveries);
  }
  const std::size_t repeated = random() % (kept + 1);
  from.wire.erase(from.wire.begin(), from.wire.begin() + static_cast<std::ptrdiff_t>(kept - repeated));
  from.wire.resize(repeated);
  if (random() % 2 == 0) {
    if (random() % 2 == 0) from.stream.disconnected();
    from.stream.connected();
  }
  to.stream.heard_of();
}

TEST(PeerStream, AnySequenceOfBreaksLosesAndRepeatsNothing) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    std::mt19937_64 random(seed);
    End a(kB, 11);
    End b(kA, 22);
    connect(a, b);
    settle(a, b);
    std::vector<std::string> to_a;
    std::vector<std::string> to_b;
    for (int step = 0; step < 300; ++step) {
      const bool forth = random() % 2 == 0;
      End& from = forth ? a : b;
      End& to = forth ? b : a;
      const std::uint64_t action = random() % 100;
      if (action < 30) {
        const std::size_t size = random() % 20 == 0 ? random() % (8 * kPartBytes) : random() % 100;
        (forth ? to_b : to_a).push_back(filled(size, static_cast<char>(step)));
        from.stream.push((forth ? to_b : to_a).back());
      } else if (action < 60) {
        from.pump();
      } else if (action < 95) {
        if (!from.wire.empty()) carry_one(from, to);
      } else {
        break_wire(from, to, random);
      }
    }
    settle(a, b);
    ASSERT_TRUE(b.got() == to_b) << "seed " << seed;
    ASSERT_TRUE(a.got() == to_a) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tessera
