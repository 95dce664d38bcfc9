// Which bodies of a partition have changed lately, for streams that tell only that. Bodies at rest in sectors
// at rest are not looked at.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/functional/function_ref.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <utility>
#include <vector>

#include "lpss/observe/state.h"

namespace tessera {

// Counts looks at the partition. A body has changed at a look if it was awake then, had fallen asleep since
// the look before, or had come to its sector since. A look must follow each tick, so that nothing wakes and
// falls asleep again in between.
class BodyChanges {
 public:
  // Between ticks.
  void look(Partition& partition);

  // Nobody asks any more: ticks may pass without a look, and what is known of changes ends.
  void forget();

  std::uint64_t looks() const { return looks_; }

  // Whether all changes after that look are known. Otherwise all bodies have to be looked at.
  bool knows_since(std::uint64_t look) const { return look >= known_from_ && known_from_ > 0; }

  // Bodies that have changed after a look, in sectors that `wants` names, as they are now.
  void for_each_since(const Partition& partition, std::uint64_t look,
                      absl::FunctionRef<bool(const SectorIndex&)> wants,
                      absl::FunctionRef<void(const BodyView&)> visit) const;

  // At most so many bodies have changed since.
  std::size_t count_since(std::uint64_t look) const;

  // The last look at which a body of that sector had changed; 0: not lately.
  std::uint64_t last_of(const SectorIndex& sector, BodyId id) const;

  // Bodies that have left a sector since, for another one, another server or for good. Some more than once.
  void for_each_left_since(std::uint64_t look, absl::FunctionRef<void(BodyId)> visit) const;

  // Nobody will ask for changes up to that look any more.
  void drop_until(std::uint64_t look);

 private:
  struct Body {
    BodyId id;
    std::uint64_t at;  // the last look at which it had changed; 0: long ago
    bool awake;        // at the last look
  };
  struct Changed {
    SectorIndex sector;
    std::uint64_t at = 0;  // the last of its bodies
    bool active = false;
    std::vector<Body> bodies;  // ascending
  };
  using Places = absl::flat_hash_map<SectorIndex, std::list<Changed>::iterator>;

  static constexpr std::size_t kLeftMax = std::size_t{1} << 18;

  void look_at(const Partition& partition, const SectorIndex& index, bool arrived);
  bool compare(const Changed* known, bool arrived);

  std::uint64_t looks_ = 0;
  std::uint64_t known_from_ = 0;  // 0: nothing is
  std::list<Changed> changed_;    // ascending by `at`
  Places places_;
  std::vector<SectorIndex> active_;  // at the last look
  std::deque<std::pair<std::uint64_t, BodyId>> left_;
  std::vector<Body> scratch_;
};

}  // namespace tessera
