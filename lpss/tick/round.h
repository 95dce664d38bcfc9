// A round of a tick: the messages that a server sends, and those that it awaits before it goes on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "lpss/tick/messages.h"

namespace tessera {

// In the order in which they run; most ticks have neither transfers nor shipments to speak of. There is a
// round of motions for each stage of each sweep, and there may be several of seams. Agreements come before
// the rounds in which a server may have something for one that does not await it. In the order of
// RoundMessage.
enum class RoundKind : std::uint8_t {
  kIdle,
  kAgreement,
  kTransfer,
  kExchange,
  kSeams,
  kShipment,
  kMotions,
  kSolution,
  kAsks,
  kAnswers,
  kActs
};

// By the places of their messages in RoundMessage.
inline constexpr std::array<const char*, std::variant_size_v<RoundMessage>> kRoundNames = {
    "agreement", "transfer", "exchange", "seams",   "shipment",
    "motions",   "solution", "asks",     "answers", "acts"};

// What was sent or received in the rounds of one kind.
struct RoundTraffic {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;  // of messages as packed

  void add(std::size_t size) {
    ++messages;
    bytes += size;
  }
};
using TrafficByRound = std::array<RoundTraffic, std::variant_size_v<RoundMessage>>;

struct Round {
  std::uint32_t number = 0;  // the same for all that send and await it; no two of a tick are the same
  std::vector<std::optional<RoundMessage>> to;  // by rank; to itself, too
  std::vector<bool> from;                       // by rank: who sends something in this round
};

// A round of this kind in which nobody has anything to say yet. `repetition`: of those that a tick has
// several of.
Round make_round(RoundKind kind, std::size_t servers, std::uint32_t repetition = 0);

}  // namespace tessera
