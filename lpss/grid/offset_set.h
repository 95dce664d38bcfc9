// A set of sectors around a sector, usually small enough to be sent with every body.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "lpss/grid/sector_index.h"

namespace tessera {

// Sectors around a home sector: where clones of its bodies may be needed. Usually these are neighbours
// (distance 1); distance 2 occurs for bodies of nearly a sector's size. Those farther away, on the way of a
// body that passes over many sectors in a tick, are listed.
class OffsetSet {
 public:
  static constexpr int kReach = 2;  // of what needs no list

  using Near = std::array<std::uint64_t, 2>;                         // a bit each, from the lowest on
  static constexpr std::uint64_t kNearMax = std::uint64_t{1} << 61;  // the second word is less: 125 bits

  OffsetSet() = default;
  // Whether they ascend, and all are farther away than kReach.
  static bool are_far(std::span<const SectorOffset> offsets) {
    const bool ascend = std::ranges::adjacent_find(offsets, std::greater_equal<>()) == offsets.end();
    return ascend && std::ranges::none_of(offsets, is_near);
  }
  // `far`: are_far().
  OffsetSet(const Near& near, std::vector<SectorOffset> far) : near_(near) { set_far(std::move(far)); }

  // Of `all`, which ascend.
  explicit OffsetSet(const std::vector<SectorOffset>& all) {
    std::vector<SectorOffset> far;
    for (const SectorOffset& offset : all) is_near(offset) ? insert(offset) : far.push_back(offset);
    set_far(std::move(far));
  }

  void insert(const SectorOffset& offset) {
    if (!is_near(offset)) return merge(OffsetSet({}, {offset}));
    const int bit = bit_of(offset);
    near_[bit / 64] |= std::uint64_t{1} << (bit % 64);
  }
  void insert(int i, int j, int k) { insert(SectorOffset{i, j, k}); }
  bool contains(const SectorOffset& offset) const {
    if (!is_near(offset)) return std::binary_search(far().begin(), far().end(), offset);
    const int bit = bit_of(offset);
    return (near_[bit / 64] >> (bit % 64)) & 1;
  }
  bool contains(int i, int j, int k) const { return contains(SectorOffset{i, j, k}); }
  // Those that come before the home itself, in lexicographic order.
  OffsetSet lower() const {
    OffsetSet result;
    result.near_[0] = near_[0] & kBeforeHome;
    const auto end = std::lower_bound(far().begin(), far().end(), SectorOffset{});
    result.set_far({far().begin(), end});
    return result;
  }
  bool empty() const { return (near_[0] | near_[1]) == 0 && !far_; }
  void merge(const OffsetSet& other) {
    near_[0] |= other.near_[0];
    near_[1] |= other.near_[1];
    if (!other.far_) return;
    std::vector<SectorOffset> all;
    std::ranges::set_union(far(), other.far(), std::back_inserter(all));
    set_far(std::move(all));
  }

  const Near& near() const { return near_; }
  std::span<const SectorOffset> far() const {  // ascending
    return far_ ? std::span<const SectorOffset>(*far_) : std::span<const SectorOffset>();
  }

  friend bool operator==(const OffsetSet& a, const OffsetSet& b) {
    return a.near_ == b.near_ && (a.far_ == b.far_ || std::ranges::equal(a.far(), b.far()));
  }

  // Calls `visit(const SectorOffset&)` for each member in lexicographic order.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    auto far = this->far().begin();
    for (int word = 0; word < 2; ++word) {
      for (std::uint64_t rest = near_[word]; rest != 0; rest &= rest - 1) {
        const int bit = word * 64 + std::countr_zero(rest);
        const SectorOffset offset{bit / 25 - kReach, bit / 5 % 5 - kReach, bit % 5 - kReach};
        while (far != this->far().end() && *far < offset) visit(*far++);
        visit(offset);
      }
    }
    while (far != this->far().end()) visit(*far++);
  }

 private:
  static constexpr std::uint64_t kBeforeHome = (std::uint64_t{1} << 62) - 1;  // bit_of({0, 0, 0}) is 62

  static bool is_near(const SectorOffset& offset) {
    const auto within = [](std::int64_t n) { return -kReach <= n && n <= kReach; };
    return within(offset.i) && within(offset.j) && within(offset.k);
  }
  static int bit_of(const SectorOffset& offset) {
    return static_cast<int>(((offset.i + kReach) * 5 + (offset.j + kReach)) * 5 + (offset.k + kReach));
  }
  void set_far(std::vector<SectorOffset> far) {
    far_ = far.empty() ? nullptr : std::make_shared<const std::vector<SectorOffset>>(std::move(far));
  }

  Near near_{};
  std::shared_ptr<const std::vector<SectorOffset>> far_;  // null if there is none
};

}  // namespace tessera
