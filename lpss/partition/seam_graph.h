// Islands that reach over borders, joined from the parts that all servers report.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/container/inlined_vector.h>

#include <span>
#include <vector>

#include "lpss/grid/sector_index.h"
#include "lpss/partition/island_part.h"

namespace tessera {

// One part of an island: the `part`-th that was last reported of `sector`.
struct PartRef {
  SectorIndex sector;
  std::uint32_t part = 0;

  friend auto operator<=>(const PartRef&, const PartRef&) = default;
};

// An awake island that reaches over a border. Every server that looks comes to the same list.
struct SeamIsland {
  BodyId id;                   // the smallest of its bodies
  std::vector<PartRef> parts;  // ascending by their first bodies
  bool all_want_sleep = true;  // it may fall asleep
  // Of its parts.
  std::uint64_t bodies = 0;
  std::uint64_t contacts = 0;
  int substeps = 0;  // that its contacts ask for
  bool bounces = false;
  bool is_indivisible = false;
};

// A part, as it was last reported.
struct SeamPart {
  IslandPart said;
  PartRef place;
  absl::InlinedVector<SeamPart*, 2> joined;  // parts that share a body with it, once for each

  // It is an island of its own.
  bool is_alone() const { return joined.empty(); }
};

// The parts of all sectors of the world that reach over borders. What was reported of a sector holds until
// something else is: sleeping sectors stay silent, and cost nothing until an awake part touches one of
// theirs.
class SeamGraph {
 public:
  void replace(const SectorSeams& seams);

  // Forgets what was reported of the sectors that `is_kept` is false of.
  template <typename IsKept>
  void keep_only(const IsKept& is_kept) {
    std::vector<SectorIndex> others;
    for (const auto& [sector, parts] : parts_) {
      if (!is_kept(sector)) others.push_back(sector);
    }
    for (const SectorIndex& sector : others) replace({sector, {}});
  }

  // The parts of each island that has an awake part in one of `awake`, those of a part that is alone, too.
  std::vector<std::vector<const SeamPart*>> parts_of_awake(std::span<const SectorIndex> awake) const;

  // The islands that have an awake part in one of `awake`, in ascending order of ids, without those of a part
  // that is alone.
  std::vector<SeamIsland> awake_islands(std::span<const SectorIndex> awake) const;

  // The island of a part.
  SeamIsland island_of(const PartRef& ref) const;

  // What was last reported of a sector.
  std::span<const SeamPart> parts_of(const SectorIndex& sector) const;

  // What was last reported of all sectors, ascending; sectors without parts are left out.
  std::vector<SectorSeams> reported() const;

  const IslandPart& part(const PartRef& ref) const { return parts_of(ref.sector)[ref.part].said; }

 private:
  void join(SeamPart& part);
  void separate(const SeamPart& part);

  absl::flat_hash_map<SectorIndex, std::vector<SeamPart>> parts_;
  absl::flat_hash_map<BodyId, absl::InlinedVector<SeamPart*, 2>> by_body_;
};

}  // namespace tessera
