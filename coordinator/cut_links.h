// Whom a world goes on without where not all of its servers hear each other.
#pragma once

#include <span>
#include <vector>

#include "transport/link.h"

namespace tessera {

// Of two servers of a world, one waits for the other in vain. Which of them is the cause cannot be known:
// what the one sends may be lost, or what the other does.
struct CutLink {
  NodeId waits;
  NodeId awaited;

  friend auto operator<=>(const CutLink&, const CutLink&) = default;
};

// The servers without which no such link is left, in ascending order: again and again the server with which
// most others have one, so that most go on; of several, the one with the largest node.
std::vector<NodeId> servers_to_drop(std::span<const CutLink> links);

}  // namespace tessera
