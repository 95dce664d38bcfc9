// A set of sectors around a sector, small enough to be sent with every body.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "lpss/grid/sector_index.h"

namespace tessera {

// Sectors up to two away from a home sector in each direction: where clones of its bodies may be needed.
// Usually these are neighbours (distance 1); distance 2 occurs for bodies of nearly a sector's size.
class OffsetSet {
 public:
  static constexpr int kReach = 2;

  void insert(int i, int j, int k) {
    const int bit = bit_of(i, j, k);
    words_[bit / 64] |= std::uint64_t{1} << (bit % 64);
  }
  bool contains(int i, int j, int k) const {
    const int bit = bit_of(i, j, k);
    return (words_[bit / 64] >> (bit % 64)) & 1;
  }
  // Those that come before the home itself, in lexicographic order.
  OffsetSet lower() const {
    constexpr std::uint64_t kBeforeHome = (std::uint64_t{1} << 62) - 1;  // bit_of(0, 0, 0) is 62
    OffsetSet result;
    result.words_[0] = words_[0] & kBeforeHome;
    return result;
  }
  bool empty() const { return (words_[0] | words_[1]) == 0; }
  void merge(const OffsetSet& other) {
    words_[0] |= other.words_[0];
    words_[1] |= other.words_[1];
  }

  friend bool operator==(const OffsetSet&, const OffsetSet&) = default;

  // Calls `visit(const SectorOffset&)` for each member in lexicographic order.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (int word = 0; word < 2; ++word) {
      for (std::uint64_t rest = words_[word]; rest != 0; rest &= rest - 1) {
        const int bit = word * 64 + std::countr_zero(rest);
        visit(SectorOffset{bit / 25 - kReach, bit / 5 % 5 - kReach, bit % 5 - kReach});
      }
    }
  }

 private:
  static int bit_of(int i, int j, int k) { return ((i + kReach) * 5 + (j + kReach)) * 5 + (k + kReach); }

  std::array<std::uint64_t, 2> words_{};
};

}  // namespace tessera
