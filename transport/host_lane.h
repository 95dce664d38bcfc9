// Messages from one process to another on the same host, through memory that both see: a ring of bytes that
// one writes and the other reads. It takes about a microsecond where a datagram and two threads that wake
// take a hundred.
//
// The writer makes the ring and offers it by process and file descriptor; the reader opens it there, which
// the kernel allows to processes of the same user alone. Nothing has a name, so nothing is left behind.
// Either end may be any process, and what it writes anything: each checks what it reads, and none can make
// the memory smaller.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "transport/descriptor.h"
#include "transport/peer_stream.h"

namespace tessera {

// Where a ring is. Plain data: it travels to the reader.
struct LaneOffer {
  std::int64_t process = 0;  // 0: there is none
  std::int64_t descriptor = 0;
  std::array<std::uint64_t, 2> token = {};  // drawn at random: that memory and no other

  friend bool operator==(const LaneOffer&, const LaneOffer&) = default;
};

inline constexpr std::size_t kLaneBytes = 1 << 20;
// With larger ones a ring would be full at once; they are for the network.
inline constexpr std::size_t kLaneMessageBytesMax = kLaneBytes / 4;

struct LaneMemory;  // what both processes map

struct LaneUnmapper {
  void operator()(LaneMemory* memory) const;
};
using MappedLane = std::unique_ptr<LaneMemory, LaneUnmapper>;

// For one thread, like the reader.
class LaneWriter {
 public:
  // Null where the system gives no such memory.
  static std::unique_ptr<LaneWriter> create();

  const LaneOffer& offer() const { return offer_; }

  // Whether the process of that session has opened it. A ring serves one process and no successor.
  bool serves(Session reader) const;

  // Appends a message that is to be read after all packets of the network up to number `after`. False if
  // there is no room for it now, or if it is too large.
  bool write(std::uint64_t after, std::string_view payload);

  // True, once, if the reader has stopped looking: it must be woken.
  bool take_asleep();

 private:
  LaneWriter(MappedLane memory, Descriptor open, LaneOffer offer)
      : memory_(std::move(memory)), open_(std::move(open)), offer_(offer) {}
  void put(const void* bytes, std::size_t size);

  MappedLane memory_;
  Descriptor open_;  // by which the reader finds the memory
  LaneOffer offer_;
  std::uint64_t head_ = 0;  // bytes written, ever
};

class LaneReader {
 public:
  // Null if the ring is not to be had: on another host or network, of another user, or another process has
  // it.
  static std::unique_ptr<LaneReader> open(const LaneOffer& offer, Session self);

  const LaneOffer& offer() const { return offer_; }

  // Whether there is a message that may be read once the network's packets up to number `received` have been.
  bool ready(std::uint64_t received);
  // That message, the first one.
  std::optional<std::string> read(std::uint64_t received);

  // Before the reader sleeps: whoever writes from now on wakes it. Then look once more whether something is
  // ready.
  void sleep();
  void stop_sleeping();

  // False once nobody can write any more: the writer has ended, or given the ring up.
  bool has_writer() const;

 private:
  LaneReader(MappedLane memory, LaneOffer offer) : memory_(std::move(memory)), offer_(offer) {}
  void get(std::uint64_t at, void* bytes, std::size_t size) const;

  MappedLane memory_;
  LaneOffer offer_;
  std::uint64_t tail_ = 0;        // bytes read, ever
  std::uint64_t next_bytes_ = 0;  // of the message that is ready
  bool broken_ = false;           // what is written is none of ours
};

}  // namespace tessera
