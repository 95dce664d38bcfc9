// Who has to hear of a body: sets of servers.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "lpss/grid/sector_map.h"
#include "lpss/tick/messages.h"

namespace tessera {

// A set of ranks: a word of bits, and more in worlds of more than 64 servers.
class Ranks {
 public:
  Ranks() = default;
  Ranks(std::initializer_list<Rank> ranks) {
    for (const Rank rank : ranks) insert(rank);
  }
  // 0 to n - 1.
  static Ranks first(std::size_t n);

  void insert(Rank rank) {
    if (rank >= 64 && place(rank) >= more_.size()) more_.resize(place(rank) + 1, 0);
    word(rank) |= bit(rank);
  }
  void erase(Rank rank) {
    if (rank < 64 || place(rank) < more_.size()) word(rank) &= ~bit(rank);
  }
  bool contains(Rank rank) const {
    if (rank < 64) return (first_ & bit(rank)) != 0;
    return place(rank) < more_.size() && (more_[place(rank)] & bit(rank)) != 0;
  }
  bool empty() const { return first_ == 0 && (more_.empty() || has_no_more()); }

  Ranks& operator|=(const Ranks& other) {
    first_ |= other.first_;
    if (!other.more_.empty()) add_more(other);
    return *this;
  }
  Ranks& operator-=(const Ranks& other) {
    first_ &= ~other.first_;
    if (!more_.empty()) remove_more(other);
    return *this;
  }
  friend Ranks operator|(Ranks a, const Ranks& b) { return a |= b; }
  // Those of `a` that are not in `b`.
  friend Ranks operator-(Ranks a, const Ranks& b) { return a -= b; }

  // In ascending order.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for_each_in(first_, 0, visit);
    for (std::size_t n = 0; n < more_.size(); ++n) for_each_in(more_[n], (n + 1) * 64, visit);
  }

 private:
  template <typename Visit>
  static void for_each_in(std::uint64_t word, std::size_t first, Visit& visit) {
    for (; word != 0; word &= word - 1)
      visit(static_cast<Rank>(first + static_cast<std::size_t>(std::countr_zero(word))));
  }

  // Of a rank from 64 on.
  static std::size_t place(Rank rank) { return rank / 64 - 1; }
  static std::uint64_t bit(Rank rank) { return std::uint64_t{1} << (rank % 64); }

  std::uint64_t& word(Rank rank) { return rank < 64 ? first_ : more_[place(rank)]; }
  bool has_no_more() const;
  void add_more(const Ranks& other);
  void remove_more(const Ranks& other);

  std::uint64_t first_ = 0;
  std::vector<std::uint64_t> more_;
};

// The servers of the sectors at `replicated_in` from `home`.
Ranks owners(const SectorMap& map, const SectorIndex& home, const OffsetSet& targets);

inline Ranks everyone(const SectorMap& map) { return Ranks::first(map.servers()); }

// Tells every server that has to know of a body, or had to until now.
void announce(std::vector<Exchange>& outbox, const BodyProperties& properties, const ReplicaUpdate& update,
              const Ranks& before, const Ranks& now);

}  // namespace tessera
