// Connected components: which bodies belong together over contacts and joints.
#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace tessera {

// Union-find over 0..n-1; the root of a set is its smallest member, so the result does not depend on the
// order of the calls.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n = 0) { reset(n); }

  // Each of 0..n-1 alone.
  void reset(std::size_t n) {
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

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

}  // namespace tessera
