#include "lpss/tick/recipients.h"

#include <algorithm>

namespace tessera {

Ranks Ranks::first(std::size_t n) {
  Ranks ranks;
  for (; n >= 64; n -= 64) ranks.words_.push_back(~std::uint64_t{0});
  if (n > 0) ranks.words_.push_back((std::uint64_t{1} << n) - 1);
  return ranks;
}

void Ranks::insert(Rank rank) {
  if (place(rank) >= words_.size()) words_.resize(place(rank) + 1, 0);
  words_[place(rank)] |= bit(rank);
}

bool Ranks::empty() const {
  return std::all_of(words_.begin(), words_.end(), [](std::uint64_t word) { return word == 0; });
}

Ranks& Ranks::operator|=(const Ranks& other) {
  if (words_.size() < other.words_.size()) words_.resize(other.words_.size(), 0);
  for (std::size_t n = 0; n < other.words_.size(); ++n) words_[n] |= other.words_[n];
  return *this;
}

Ranks& Ranks::operator-=(const Ranks& other) {
  for (std::size_t n = 0; n < std::min(words_.size(), other.words_.size()); ++n)
    words_[n] &= ~other.words_[n];
  return *this;
}

Ranks owners(const SectorMap& map, const SectorIndex& home, const OffsetSet& targets) {
  Ranks ranks;
  targets.for_each([&](const SectorOffset& offset) {
    const absl::StatusOr<SectorIndex> sector = translated(home, offset);
    if (sector.ok()) ranks.insert(map.owner(*sector));
  });
  return ranks;
}

void announce(std::vector<Exchange>& outbox, const BodyProperties& properties, const ReplicaUpdate& update,
              const Ranks& before, const Ranks& now) {
  (before - now).for_each([&](Rank rank) { outbox[rank].gone.push_back(update.id); });
  (now - before).for_each([&](Rank rank) { outbox[rank].introductions.push_back({update.id, properties}); });
  now.for_each([&](Rank rank) { outbox[rank].replicas.push_back(update); });
}

}  // namespace tessera
