// A sector with all that its server keeps of it: what travels when a sector changes servers.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/partition/body_joints.h"
#include "lpss/partition/partition.h"
#include "lpss/partition/replicas.h"

namespace tessera {

// A body of such a sector, with what its home keeps of it.
struct MovedBody {
  BodyRecord record;
  OffsetSet replicated_in;
  bool known_everywhere = false;
  std::optional<SectorIndex> next_home;
  std::optional<BodyState> kinematic_target;
  bool dirty = false;
  BodyJoints joints;
};

// A replica that the sector lists.
struct MovedClone {
  ReplicaIntroduction introduction;
  ReplicaUpdate update;
  bool placed = false;  // in the engine world
  bool fresh = false;   // the engine world has not been told of the update
};

// All of one sector, such that its new server goes on as the old one would have.
struct MovedSector {
  SectorIndex sector;
  std::vector<MovedBody> bodies;
  std::vector<MovedClone> clones;
  std::vector<ManifoldState> manifolds;
  std::vector<std::pair<BodyId, BodyId>> touching;
  std::vector<Overlap> overlaps;
  std::array<double, 6>
      static_region{};  // low and high corner, m, of the region that statics are complete for
  bool parts_reported = false;
  std::vector<IslandPart> parts;  // as they were last reported; see with_parts()
  bool active = false;            // the next tick would have looked at it
};

// Without its parts of islands, which the seam graph keeps, also while the sector is packed.
MovedSector pack_sector(const Partition& partition, const Sector& sector);

// The same with these, for one that leaves the partition.
MovedSector with_parts(const Partition& partition, MovedSector sector);

// Forgets the sector, and the replicas that only it needed.
void forget_sector(Partition& partition, Sector& sector);

// Takes a sector over, with the bits that it had; the next tick looks at it. The partition must not have it
// yet.
void unpack_sector(Partition& partition, const MovedSector& moved);

}  // namespace tessera
