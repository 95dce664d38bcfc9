// What the shares of one world tell each other in the course of a tick.
//
// Rounds, each a message from every share to every peer that needs one (docs/architecture.md):
//   Transfer  sectors that change servers; only in ticks in which the sector map changes
//   Exchange  who moved, whose clone is where            -> detection
//   Seams     which bodies hang together across borders  -> islands
//   Shipment  the parts of islands that a peer solves    -> solution
//   Coupling  what a solver pass did to shared bodies; once a pass, only for islands beyond the cap
//   Solution  the new velocities, back to the owners     -> integration
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/grid/offset_set.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/partition/island_part.h"

namespace tessera {

using Tick = std::uint64_t;

// The properties of a body that the receiver has not heard of yet.
struct BodyIntroduction {
  BodyId id;
  BodyProperties properties;
};

// A body near a seam, as of the beginning of the tick. Sent while the body is awake, once more when it has
// fallen asleep, and then not until something changes.
struct GhostUpdate {
  BodyId id;
  SectorIndex home;
  SectorIndex next_home;  // where it will live from the next tick on; the home itself if it stays
  OffsetSet targets;      // relative to `home`: the sectors that must have a clone
  BodyState state;        // relative to the centre of `home`
};

// A body that lives in one of the receiver's sectors from this tick on; `record.home` is its new home.
struct Handover {
  BodyRecord record;
  OffsetSet targets;  // relative to the new home: the sectors that were told in the same tick to have a clone
  bool everywhere = false;  // all shares were told of it
};

// The contact points of a pair that is detected in sector `to` from this tick on.
struct ManifoldTransfer {
  SectorIndex to;
  bool was_touching = false;  // so that the contact does not begin again
  ManifoldState manifold;
};

struct Exchange {
  std::vector<BodyIntroduction> introductions;
  std::vector<GhostUpdate> ghosts;
  std::vector<BodyId> gone;  // no clone of these is needed any longer
  std::vector<Handover> handovers;
  std::vector<ManifoldTransfer> manifolds;
  bool quiet = false;  // nothing of the sender's moves, and nothing in here changes that
};

// A body of a sector that changes servers, with what its home keeps of it.
struct MovedBody {
  BodyRecord record;
  OffsetSet targets;
  bool everywhere = false;
  std::optional<SectorIndex> next_home;
  std::optional<BodyState> goal;
  bool news = false;
};

// A ghost that a sector which changes servers has on its list.
struct MovedClone {
  BodyIntroduction introduction;
  GhostUpdate update;
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
  std::array<double, 6>
      static_region{};  // low and high corner, m, of the region that statics are complete for
  bool parts_known = false;
};

struct Transfer {
  std::vector<MovedSector> sectors;
};

// The parts of islands in one sector that reach over a border; replaces what was said of the sector before.
struct SectorSeams {
  SectorIndex sector;
  std::vector<IslandPart> parts;
};

struct Seams {
  std::vector<SectorSeams> sectors;  // of the sectors that were awake in this tick
};

// A body of a part that is solved elsewhere.
struct ShippedBody {
  BodyRecord record;  // state after the first half of the step
  Wrench wrench;      // gathered for the solver
};

// The contact points of a pair that was detected in `sector`.
struct ShippedContact {
  SectorIndex sector;
  ManifoldState manifold;
};

// The sender's share of one island.
struct ShippedIsland {
  BodyId island;                    // the smallest id of its bodies
  std::vector<ShippedBody> bodies;  // kinematic partners among them
  std::vector<ShippedContact> contacts;
};

struct Shipment {
  std::vector<ShippedIsland> islands;
  std::vector<ShippedBody> shared;  // bodies of coupled islands that parts of the receiver have copies of
};

// What one solver pass did to one part's copy of a shared body. Parts are named by the first of their bodies.
struct SharedChange {
  BodyId body;
  BodyId part;
  VelocityChange change;
};

struct Coupling {
  std::vector<SharedChange> changes;
};

struct SolvedBody {
  BodyId id;
  BodyState state;
};

struct Solution {
  std::vector<SolvedBody> bodies;
  std::vector<ShippedContact> contacts;  // with the impulses of the solution
};

// What a client asked for, in the order that the sequencer gave it. Positions are those of the centre frame,
// canonical.
struct SpawnBody {
  BodyRecord record;
};
struct RemoveBody {
  BodyId id;
};
struct SetVelocity {
  BodyId id;
  std::array<double, 3> linear{};
  std::array<double, 3> angular{};
};
struct ApplyImpulse {
  BodyId id;
  std::array<double, 3> impulse{};  // N s
  std::array<double, 3> lever{};    // m, from the centre of mass, world axes
};
// For one tick.
struct ApplyForce {
  BodyId id;
  Wrench wrench;
};
// At once, without passing the way between; velocities are set too.
struct Teleport {
  BodyId id;
  SectorIndex home;
  BodyState state;
};
// A kinematic body moves so that it arrives there at the end of this tick.
struct KinematicTarget {
  BodyId id;
  SectorIndex home;
  BodyState state;
};

// A joint between bodies of any two sectors; all servers know all joints.
struct AddJoint {
  JointRecord record;
};
struct RemoveJoint {
  JointId id;
};
struct SetDrives {
  JointId id;
  JointDrives drives;
};

using Command = std::variant<SpawnBody, RemoveBody, SetVelocity, ApplyImpulse, ApplyForce, Teleport,
                             KinematicTarget, AddJoint, RemoveJoint, SetDrives>;

using RoundMessage =
    std::variant<Transfer, Exchange, std::shared_ptr<const Seams>, Shipment, Coupling, Solution>;

enum class ContactPhase : std::uint8_t { kBegin, kPersist, kEnd };

// A contact of two bodies, reported once, by the sector that detected it.
struct ContactEvent {
  Tick tick = 0;
  ContactPhase phase = ContactPhase::kBegin;
  BodyId a;  // a < b
  BodyId b;
  WorldPosition position;  // on b; not set for kEnd
  std::array<double, 3> normal{};
  double impulse = 0;  // N s
  double depth = 0;    // m, > 0 where the bodies overlap
};

}  // namespace tessera
