// Which bodies belong together: connected components over contacts, and the parts of islands that sectors know.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "lpss/engine/body.h"

namespace tessera {

// Union-find over 0..n-1; the root of a set is its smallest member, so the result does not depend on the
// order of the calls.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t find(std::size_t x) {
    while (parent_[x] != x) {
      parent_[x] = parent_[parent_[x]];
      x = parent_[x];
    }
    return x;
  }
  void unite(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    if (a == b) return;
    parent_[a < b ? b : a] = a < b ? a : b;
  }

 private:
  std::vector<std::size_t> parent_;
};

// A part of an island: bodies that touch one another and are known to one sector, or one server.
struct IslandPart {
  std::vector<BodyId> links;  // bodies by which other parts may belong to the same island
  BodyId first;               // the smallest id of its own bodies: the part's name
  std::uint32_t bodies = 0;   // own dynamic bodies
  std::uint32_t contacts = 0;
  bool any_awake = false;
  bool all_drowsy = true;     // every own body is ready to sleep or asleep
};

}  // namespace tessera
