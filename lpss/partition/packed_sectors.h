// Sectors at rest, in some hundred bytes a body: what a partition keeps of regions where nothing moves.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/container/inlined_vector.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/grid/sector_index.h"
#include "lpss/model/body.h"

namespace tessera {

struct MovedSector;

// Properties, each kept once for all bodies that share them, as long as there is one.
class PropertiesPool {
 public:
  using Key = std::uint32_t;

  Key hold(const BodyProperties& properties);
  void release(const BodyProperties& properties);  // that were held as often, and once more
  const BodyProperties& operator[](Key key) const { return entries_[key].properties; }

  std::size_t size() const { return keys_.size(); }

 private:
  struct Entry {
    BodyProperties properties;
    std::size_t holders = 0;
  };

  std::vector<Entry> entries_;
  std::vector<Key> free_;                       // of the entries, those without a holder
  absl::flat_hash_map<std::string, Key> keys_;  // by all bits of the properties
};

// Such sectors have no engine world, no bodies and no clones in memory. packing.h says when they are packed,
// and what brings them back.
class PackedSectors {
 public:
  struct Counts {
    std::size_t sectors = 0;
    std::size_t worlds = 0;  // of the sectors, those in which a body lives
    std::size_t bodies = 0;
    std::size_t bytes = 0;  // of what is packed, without its indices
  };
  const Counts& counts() const { return counts_; }

  // A sector at rest: none of its bodies is jointed, kinematic, about to change home or to be announced.
  // `touching` are the pairs that would count as touching if somebody began to ask for contact events now;
  // `has_triggers`, whether a body in it has triggers.
  void add(const MovedSector& sector, const std::vector<std::pair<BodyId, BodyId>>& touching,
           bool has_triggers = false);

  bool contains(const SectorIndex& sector) const { return sectors_.contains(sector); }

  // The sector as it was when it was added, not active. It must be there; take() removes it.
  MovedSector copy(const SectorIndex& sector) const;
  MovedSector take(const SectorIndex& sector);

  // All of them, ascending.
  std::vector<SectorIndex> sectors() const;

  // Those in which a body has triggers, ascending.
  std::vector<SectorIndex> with_triggers() const;

  // Those in which the body lives, or a clone of it is; in any order.
  std::vector<SectorIndex> holding(BodyId id) const;

  // Those in which a body has points of contact with this one, or is in a trigger of it. Linear in all that
  // is packed.
  std::vector<SectorIndex> touching(BodyId id) const;

  // Nothing where the body lives in none of them.
  std::optional<BodyRecord> body(BodyId id) const;

  // Calls `visit` for each sector with the number of bodies that live in it, in any order.
  void for_each(const std::function<void(const SectorIndex&, std::size_t)>& visit) const;

  // Calls `visit` for the bodies that live in a sector, ascending by ids. It must be there.
  void for_each_body(const SectorIndex& sector, const std::function<void(const BodyRecord&)>& visit) const;

  // Begins or ends reports of contact events (lpss/tick/events.h): what touches then begins no contact.
  void report_contacts(bool on);

  // Those that were added or taken since the last call, in any order: all others are what they were. Nothing
  // where any of them may have changed, as in the first call.
  std::optional<std::vector<SectorIndex>> take_changed();

 private:
  struct Packed {
    SectorIndex index;
    std::uint32_t bodies = 0;
    std::uint32_t reports = 0;  // as reports_ was
    bool has_triggers = false;
    std::string bytes;
  };

  MovedSector unpacked(const Packed& packed) const;
  void note_change(const SectorIndex& sector);

  absl::flat_hash_map<SectorIndex, std::unique_ptr<Packed>> sectors_;
  absl::flat_hash_map<BodyId, absl::InlinedVector<Packed*, 1>> holders_;
  PropertiesPool properties_;
  Counts counts_;
  bool reports_contacts_ = false;
  std::uint32_t reports_ = 0;      // how often that has changed
  std::size_t with_triggers_ = 0;  // sectors
  // Since take_changed(); nothing where they are not known.
  std::optional<absl::flat_hash_set<SectorIndex>> changed_;
};

}  // namespace tessera
