// The part of a world that one server hosts: everything that lasts from tick to tick.
//
// A partition is data. The functions that change it lie beside it by topic (sectors.h, bodies.h, statics.h,
// replicas.h, joints.h, moved_sector.h); the phases of the tick (lpss/tick) are made of these; what only
// looks at it is in lpss/observe. check_invariants() says what always holds between ticks.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/command.h"
#include "lpss/model/felt.h"
#include "lpss/model/world_description.h"
#include "lpss/partition/body_moves.h"
#include "lpss/partition/joint_index.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/packed_sectors.h"
#include "lpss/partition/seam_graph.h"
#include "lpss/partition/seam_rules.h"
#include "lpss/partition/sector.h"
#include "lpss/partition/static_index.h"

namespace tessera {

// Up to so many servers all talk to each other (lpss/tick/links.h).
inline constexpr std::uint32_t kAllLinkedMax = 8;

// Which part of which world.
struct PartitionOptions {
  WorldSettings settings;
  SectorIndex anchor;
  SectorMap map;
  Rank self = 0;
  // Bodies that nothing touches and no joint holds move without a solver. What comes out is the same, but for
  // the fine digits of orbits.
  bool free_flight = true;
  // Islands over several servers with at least so many contacts are solved by these in step, which takes a
  // message a sweep; smaller ones are shipped to one of them, which takes two, but all that the island is.
  // Without effect on what comes out. The same on all servers.
  std::uint64_t in_step_from = 512;
  // Ticks that a sector has been at rest when it is packed. Without effect on what comes out.
  std::uint64_t pack_after = 120;
  // Up to so many servers all talk to each other; of more, each talks to those around it. Without effect on
  // what comes out. The same on all servers.
  std::uint32_t all_linked_max = kAllLinkedMax;
  // Of grounds; outlives the partition. Null: those of the process.
  TileStore* tiles = nullptr;
};

struct Partition {
  // The engine must have been made for the settings (see engine_settings()) and outlive the partition.
  Partition(PartitionOptions options, Engine& engine_of_settings);

  // --- the world, the same on all servers ---
  WorldSettings settings;
  const SeamRules& rules;  // of its policy
  SectorIndex anchor;
  SectorMap map;
  Rank self = 0;
  bool free_flight = true;
  std::uint64_t in_step_from = 0;
  std::uint64_t pack_after = 0;
  std::uint32_t all_linked_max = 0;
  Engine& engine;
  absl::btree_map<ShapeId, ShapeRef> shapes;
  double radius_max = 0;  // m, of the largest body that can move that the world has ever had
  SeamMargins margins;    // follow from it
  StaticIndex statics;
  std::vector<CarriedFrame> carried;  // frames with carriers, ascending: at the end of the last tick
  // By FrameNumber: in the tick that runs, or else in the last one; and how often it has changed so far.
  std::vector<Felt> felt;
  std::vector<std::uint64_t> felt_changes;

  // --- what lives here ---
  absl::flat_hash_map<SectorIndex, std::unique_ptr<Sector>> sectors;
  absl::flat_hash_map<BodyId, std::unique_ptr<HomeBody>> bodies;
  absl::flat_hash_set<BodyId> jointed;  // those of `bodies` that joints hold
  std::vector<Sector*> active;          // sectors that the next tick looks at, each once
  JointIndex joints;                    // those that need be known here (joints.h)
  std::vector<JointId> left_joints;     // of bodies that have left: they may have to be known no more
  std::vector<JointId> set_joints;      // whose drives commands of this tick have set
  std::vector<BodyId> leaving;          // bodies whose announced change of home takes effect at the next tick
  std::size_t programmed_count = 0;     // of `bodies`, those that have programs
  std::size_t world_count = 0;          // sectors with an engine world
  std::size_t clone_count = 0;          // in engine worlds, as of the last detection

  // --- what lives here, and has been at rest for long (packing.h) ---
  PackedSectors packed;  // none of them is in `sectors`, none of their bodies in `bodies`
  std::deque<std::pair<std::uint64_t, SectorIndex>>
      resting;                    // sectors to pack: since when, and which; ascending
  std::uint64_t ticks_ended = 0;  // what `resting` counts in

  // --- what is known of others ---
  absl::flat_hash_map<BodyId, std::unique_ptr<Replica>> replicas;
  std::vector<BodyId> far_replicas;     // heard of in this exchange, and not listed yet; see goes_far()
  std::vector<BodyId> moving_replicas;  // replicas whose home changes at the next tick
  SeamGraph seam_graph;  // all parts of islands in sectors that are hosted here; of others, those that matter
  std::vector<SectorIndex> parts_of_others;  // sectors in it that others have told of, if not all are told
  bool at_rest = false;                      // nothing in the whole world moves
  std::vector<Command> acts;                 // what programs do at the beginning of the next tick

  // Whether contact events are gathered; see report_contacts().
  bool reports_contacts = false;
  BodyMoves body_moves;

  double dt() const { return settings.time_step; }             // s
  double sector_size() const { return settings.sector_size; }  // L, m
  const Felt& felt_in(const SectorIndex& sector) const { return felt[sector.frame]; }
  bool hosts(const SectorIndex& sector) const { return map.owner(sector) == self; }
};

// The engine settings that a world's settings ask for.
EngineSettings engine_settings(const WorldSettings& settings);

// Stops the process where the partition contradicts itself: lists that do not match, bodies whose sector does
// not know them, clones without a replica, counts that are off. Between ticks; linear in all that the
// partition has.
void check_invariants(const Partition& partition);

}  // namespace tessera
