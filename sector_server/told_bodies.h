// What a stream has told its client of bodies, and what is to be told next: what has changed since. Where
// that is too much for its budget, bodies wait: each gains priority with every batch that it is not in, more
// of it near the centre of the region, and those with the highest are told, as they are then.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_set.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "lpss/observe/body_changes.h"
#include "sector_server/body_snapshot.h"
#include "tessera.pb.h"

namespace tessera {

class ToldBodies {
 public:
  explicit ToldBodies(const v1::WatchBodiesRequest& request);

  // What the client has yet to be told, at the last look of `changes`. Reuses the memory of `snapshot`.
  // Nothing is told until told() is called; what is not is part of the next news. `bodies_max`: so many
  // bodies at most; all that are gone.
  BodySnapshot news(const Partition& partition, const BodyChanges& changes, BodySnapshot snapshot,
                    std::size_t bodies_max = std::numeric_limits<std::size_t>::max());
  // The last news will reach the client, unless its stream ends.
  void told(const BodySnapshot& news);

  // The client does not know any more what it was told: its world was set back.
  void forget() { until_.reset(); }

  // The look of which it was told last.
  std::optional<std::uint64_t> until() const { return until_; }

 private:
  struct Place {
    SectorIndex home;
    BodyState state;
  };
  // The statics among the ids that are hosted here, and of which state of the partition.
  struct Statics {
    using Versions = std::pair<std::uint64_t, std::uint64_t>;  // of the statics, and of the map
    Versions of;
    absl::btree_map<BodyId, Place> told;
  };
  class Search;

  bool knows(BodyId id) const { return told_.contains(id); }
  void find_all(const Partition& partition, Search& search) const;
  void find_changed(const Partition& partition, const BodyChanges& changes, Search& search) const;
  void find_statics(const Partition& partition, bool all, Search& search);
  void find_waiting(const Partition& partition, const BodySnapshot& found, Search& search) const;
  void choose(std::size_t bodies_max, const Search& search, BodySnapshot& found);

  const v1::WatchBodiesRequest request_;
  const absl::flat_hash_set<BodyId> ids_;  // empty: all that are not static
  std::optional<std::uint64_t> until_;
  absl::flat_hash_set<BodyId> told_;  // what the client knows, statics too
  Statics statics_;
  using Waiting = absl::btree_map<BodyId, double>;
  Waiting waiting_;  // bodies that have changed, and were not told: their priorities

  // Of the last news.
  std::uint64_t look_ = 0;
  std::optional<Statics> next_statics_;
  Waiting next_waiting_;
};

}  // namespace tessera
