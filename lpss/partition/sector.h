// What a partition keeps of one sector, of the bodies in it, and of those that visit as clones.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_set.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/grid/offset_set.h"
#include "lpss/grid/sector_index.h"
#include "lpss/partition/burden_sums.h"
#include "lpss/partition/island_part.h"

namespace tessera {

struct Replica;
struct Sector;

// A dynamic or kinematic body that lives in one of the partition's sectors. Its state is in the engine world.
struct HomeBody {
  // What loops over all bodies look at comes first.
  BodyId id;
  Sector* sector = nullptr;
  BodySlot slot = 0;
  bool dirty = false;             // others do not know its present state yet; see mark_dirty()
  bool attended = false;          // on the sector's list
  bool may_have_moved = false;    // of those: since others last heard of it; see attend_borders()
  bool jointed = false;           // some joint has it as parent or child
  bool known_everywhere = false;  // by all servers: see is_everywhere()
  OffsetSet wanted_in;            // sectors that need a replica in this tick
  OffsetSet replicated_in;        // sectors that were told of it
  BodyProperties properties;
  double radius = 0;                     // m, of a ball around the centre of mass that holds the shape
  Eigen::AlignedBox3d swept;             // of this tick; m, relative to the sector's centre
  std::optional<SectorIndex> next_home;  // announced; takes effect at the next tick
  std::optional<BodyState>
      kinematic_target;  // where it arrives at the end of this tick; there until the next
  std::vector<ProgramRecord> programs;
};

// A replica in a sector that may need it. It enters the engine world only when contact is imminent.
struct Clone {
  Replica* replica = nullptr;
  Sector* sector = nullptr;
  Eigen::Vector3d home = Eigen::Vector3d::Zero();  // m, the centre of the replica's home from the sector's
  BodySlot slot = kNoSlot;                         // in the engine world, if it is there
  BodySlot near = kNoSlot;                         // a hint: what it was last found to be near
  bool fresh = true;                               // the replica has changed since the engine world was told

  bool is_placed() const { return slot != kNoSlot; }
};

// What is known of a body near a seam, as its home last told; bodies of the partition's own sectors included.
struct Replica {
  BodyId id;
  SectorIndex home;
  SectorIndex next_home;
  OffsetSet replicated_in;        // relative to `home`
  bool known_everywhere = false;  // by all servers
  bool jointed = false;           // some joint has it as parent or child
  double surge = 0;               // m, SectorWorld::surge() in the tick of the last news
  bool is_listed = false;         // the sectors of `clones` stay those of `home` and `replicated_in`
  std::vector<std::unique_ptr<Clone>> clones;  // in the partition's sectors among them, ascending by sectors
  double radius = 0;                           // m, as HomeBody::radius
  BodyState state;                             // relative to the centre of `home`
  BodyProperties properties;

  // Whether it passes over many sectors in a tick. It then has clones only where a body lives: they are found
  // anew in each tick.
  bool goes_far() const { return !replicated_in.far().empty(); }
};

// Bodies of one sector that touch one another, clones included, as ranges of the sector's lists.
struct Component {
  std::uint32_t bodies_begin = 0;
  std::uint32_t bodies_end = 0;
  std::uint32_t pairs_begin = 0;
  std::uint32_t pairs_end = 0;
  std::uint32_t clones_begin = 0;
  std::uint32_t clones_end = 0;
  std::int32_t part = kInterior;  // its place in the sector's list of parts that reach over a border
  bool any_awake = false;
  bool any_asleep = false;  // of the bodies that live here
  bool all_want_sleep = true;

  static constexpr std::int32_t kInterior = -1;
};

struct Sector {
  SectorIndex index;
  std::unique_ptr<SectorWorld> world;  // only while a dynamic or kinematic body lives here
  std::vector<HomeBody*> homes;        // ascending by id
  std::vector<HomeBody*> kinematics;   // those of the homes that are kinematic, ascending by id
  std::vector<HomeBody*> pushed;       // those that are dynamic and have a lasting force, likewise
  std::vector<HomeBody*> programmed;   // those that have programs, likewise
  std::vector<HomeBody*> by_slot;      // homes by their slots in the engine world; null elsewhere

  // Those of the homes that others know, or that they may have to hear of; each once. All others are far from
  // the borders, and nobody is told of them.
  std::vector<HomeBody*> attended;
  absl::btree_map<BodyId, Clone*> clones;
  std::vector<Clone*> placed;      // those in the engine world, ascending by id
  std::size_t clones_counted = 0;  // of those, in the partition's sum
  absl::btree_map<BodyId, BodySlot> statics;
  Eigen::AlignedBox3d static_region;  // what `statics` is complete for; m, relative to the sector's centre
  bool active = false;                // on the partition's list
  std::uint64_t rests_since = 0;      // of its last place in the partition's list of those at rest
  bool awake = false;                 // a body or clone in the engine world is
  bool components_stale = false;      // bodies came or went since the components were found
  std::optional<BurdenSums> resting;  // of its bodies, while it is not active and somebody has asked
  std::uint64_t felt_changes = 0;     // as Partition::felt_changes was when its bodies last felt all

  // Of the last detection.
  std::vector<Component> components;
  std::vector<HomeBody*> component_bodies;  // dynamic ones
  std::vector<Clone*> component_clones;
  std::vector<std::uint32_t> component_pairs;  // places in world->contacts()
  std::vector<IslandPart> parts;               // until the others are told
  std::vector<std::uint32_t> part_components;  // the component of each part
  std::vector<BodySlot> in_free_flight;        // bodies that nothing touches and no joint holds
  bool parts_reported = false;                 // others know of parts of this sector

  absl::flat_hash_set<std::pair<BodyId, BodyId>> touching;  // pairs whose contact has begun

  // What is in which trigger, of the pairs that this sector looks after; ascending. Whether somebody watches
  // or not.
  std::vector<Overlap> overlaps;
  bool overlaps_stale = false;          // a static body has come: those that rest are looked at again, too
  std::vector<Overlap> found_overlaps;  // of a tick
};

}  // namespace tessera
