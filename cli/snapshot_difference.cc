#include "cli/snapshot_difference.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "proto/snapshot.h"
#include "proto/wire.h"

namespace tessera::cli {
namespace {

template <typename T>
std::string packed(const T& item) {
  return pack(std::span<const T>(&item, 1));
}

// Of two sectors of the same place that are not equal.
std::string difference_in(const MovedSector& a, const MovedSector& b) {
  const std::string where = absl::StrCat("sector ", to_string(a.sector));
  for (std::size_t n = 0; n < std::min(a.bodies.size(), b.bodies.size()); ++n) {
    const BodyRecord& x = a.bodies[n].record;
    const BodyRecord& y = b.bodies[n].record;
    if (x.id != y.id) break;
    if (packed(x) != packed(y)) return absl::StrCat("body ", x.id.value, " in ", where, " differs");
  }
  if (a.bodies.size() != b.bodies.size()) {
    return absl::StrCat(where, " has ", a.bodies.size(), " bodies in one and ", b.bodies.size(),
                        " in the other");
  }
  // Of the rest, what differs alone.
  MovedSector same = b;
  same.manifolds = a.manifolds;
  if (packed(same) == packed(a)) return absl::StrCat("contact points in ", where, " differ");
  same = b;
  same.clones = a.clones;
  if (packed(same) == packed(a))
    return absl::StrCat("what is known of other sectors' bodies in ", where, " differs");
  same = b;
  same.bodies = a.bodies;
  if (packed(same) == packed(a)) return absl::StrCat("what others know of bodies in ", where, " differs");
  return absl::StrCat("contacts and replicas of ", where, " differ");
}

}  // namespace

absl::StatusOr<std::string> snapshot_difference(std::span<const v1::SnapshotChunk> a,
                                                std::span<const v1::SnapshotChunk> b) {
  const absl::StatusOr<ReadSnapshot> first = from_chunks(a);
  if (!first.ok()) return first.status();
  const absl::StatusOr<ReadSnapshot> second = from_chunks(b);
  if (!second.ok()) return second.status();
  const WorldSnapshot& x = first->world;
  const WorldSnapshot& y = second->world;
  if (x.tick != y.tick) return absl::StrCat("one is of tick ", x.tick, ", the other of tick ", y.tick);
  for (std::size_t n = 0; n < std::min(x.sectors.size(), y.sectors.size()); ++n) {
    if (x.sectors[n].sector != y.sectors[n].sector) {
      return absl::StrCat("only one has sector ",
                          to_string(std::min(x.sectors[n].sector, y.sectors[n].sector)));
    }
    if (packed(x.sectors[n]) != packed(y.sectors[n])) return difference_in(x.sectors[n], y.sectors[n]);
  }
  if (x.sectors.size() != y.sectors.size()) {
    return absl::StrCat("one has ", x.sectors.size(), " sectors, the other ", y.sectors.size());
  }
  if (pack(x.shared) != pack(y.shared)) return std::string("static bodies, joints or islands differ");
  return std::string();
}

}  // namespace tessera::cli
