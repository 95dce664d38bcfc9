// Who has to hear of a body: sets of servers.
#pragma once

#include <absl/container/inlined_vector.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "lpss/grid/sector_map.h"
#include "lpss/tick/messages.h"

namespace tessera {

// A set of ranks: words of bits, of which the first alone is there in worlds of up to 64 servers.
class Ranks {
 public:
  Ranks() = default;
  Ranks(std::initializer_list<Rank> ranks) {
    for (const Rank rank : ranks) insert(rank);
  }
  // 0 to n - 1.
  static Ranks first(std::size_t n);

  void insert(Rank rank);
  void erase(Rank rank) {
    if (place(rank) < words_.size()) words_[place(rank)] &= ~bit(rank);
  }
  bool contains(Rank rank) const {
    return place(rank) < words_.size() && (words_[place(rank)] & bit(rank)) != 0;
  }
  bool empty() const;

  Ranks& operator|=(const Ranks& other);
  Ranks& operator-=(const Ranks& other);
  friend Ranks operator|(Ranks a, const Ranks& b) { return a |= b; }
  // Those of `a` that are not in `b`.
  friend Ranks operator-(Ranks a, const Ranks& b) { return a -= b; }

  // In ascending order.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t n = 0; n < words_.size(); ++n) {
      for (std::uint64_t word = words_[n]; word != 0; word &= word - 1)
        visit(static_cast<Rank>(n * 64 + static_cast<std::size_t>(std::countr_zero(word))));
    }
  }

 private:
  static std::size_t place(Rank rank) { return rank / 64; }
  static std::uint64_t bit(Rank rank) { return std::uint64_t{1} << (rank % 64); }

  absl::InlinedVector<std::uint64_t, 1> words_;
};

// The servers of the sectors at `replicated_in` from `home`.
Ranks owners(const SectorMap& map, const SectorIndex& home, const OffsetSet& targets);

inline Ranks everyone(const SectorMap& map) { return Ranks::first(map.servers()); }

// Tells every server that has to know of a body, or had to until now.
void announce(std::vector<Exchange>& outbox, const BodyProperties& properties, const ReplicaUpdate& update,
              const Ranks& before, const Ranks& now);

}  // namespace tessera
