#include "lpss/tick/recipients.h"

#include <algorithm>

namespace tessera {

Ranks Ranks::first(std::size_t n) {
  const auto word_of = [](std::size_t count) {
    return count >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  };
  Ranks ranks;
  ranks.first_ = word_of(n);
  for (; n > 64; n -= 64) ranks.more_.push_back(word_of(n - 64));
  return ranks;
}

bool Ranks::has_no_more() const {
  return std::all_of(more_.begin(), more_.end(), [](std::uint64_t word) { return word == 0; });
}

void Ranks::add_more(const Ranks& other) {
  if (more_.size() < other.more_.size()) more_.resize(other.more_.size(), 0);
  for (std::size_t n = 0; n < other.more_.size(); ++n) more_[n] |= other.more_[n];
}

void Ranks::remove_more(const Ranks& other) {
  for (std::size_t n = 0; n < std::min(more_.size(), other.more_.size()); ++n) more_[n] &= ~other.more_[n];
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
