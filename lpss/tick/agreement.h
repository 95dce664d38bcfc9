// Agreement: what all servers must know before they go on, up a tree of them and down again.
//
// The tree follows from the number of servers alone. Each server tells its parent what it and those below it
// say, in one message, and is told what all say, in another. Calls and the like go no farther up than to the
// server below which both sides are, and down to the one that they are for: a message is as long as what
// concerns the servers below, not as the world is large.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "lpss/tick/round.h"

namespace tessera {

// Servers below one server of the tree, directly.
inline constexpr Rank kTreeFan = 8;

class AgreementTree {
 public:
  // `number`: of agreements in this tick. Nothing if there are no others: there is a result.
  std::optional<Round> begin(Rank self, std::size_t servers, Agreement mine, std::uint32_t number);

  // Goes on with what was sent, by rank; then likewise.
  std::optional<Round> advance(std::vector<Agreement> inbox);

  // What all say; calls and hosts are those for this server.
  const Agreement& result() const { return said_; }

 private:
  enum class Stage { kGathering, kAsking, kTelling };

  void check(const Agreement& said) const;
  Round round() const;
  std::optional<Round> ask();
  std::optional<Round> tell();
  // The server directly below this one by way of which another is reached; none if it is not below.
  std::optional<Rank> way_down(Rank to) const;

  template <typename Visit>
  void for_each_below(Visit&& visit) const;

  Rank self_ = 0;
  std::size_t servers_ = 1;
  std::uint32_t number_ = 0;
  Stage stage_ = Stage::kGathering;
  Agreement said_;  // by this server and those below it, then by all
};

}  // namespace tessera
