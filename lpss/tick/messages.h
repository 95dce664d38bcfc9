// What the servers of one world tell each other in the course of a tick.
//
// Rounds, each a message from every server to every peer that needs one (docs/architecture.md):
//
// - Agreement: what all must know, up and down a tree; only between many servers.
// - Transfer: sectors that change servers; only where the sector map changes.
// - Exchange: who moved, and who is near a seam. Detection follows.
// - Seams: the parts of islands that reach over borders. Islands follow.
// - Shipment: the parts of islands that a peer solves, and what it must know of islands that are solved in
//   step: as arrays of numbers.
// - Motions: how bodies at seams move, before each stage in which others have them.
// - Solution: the new velocities, back to the owners. Integration follows.
// - Asks, Answers, Acts: what programs ask of the world, what they are told, and what they do; only where
//   there are programs.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/model/body.h"
#include "lpss/model/command.h"
#include "lpss/model/contact_phase.h"
#include "lpss/model/joint.h"
#include "lpss/partition/body_joints.h"
#include "lpss/partition/burden_sums.h"
#include "lpss/partition/contact_patch.h"
#include "lpss/partition/island_part.h"
#include "lpss/partition/moved_sector.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/world_state.h"
#include "lpss/programs/senses.h"

namespace tessera {

using Tick = std::uint64_t;

// A set of the stages of seams (solve_order.h), a bit each.
using SeamStages = std::uint8_t;

// A body that lives in one of the receiver's sectors from this tick on; `record.home` is its new home.
struct Handover {
  BodyRecord record;
  OffsetSet
      replicated_in;  // relative to the new home: the sectors that were told in the same tick to have a clone
  bool known_everywhere = false;  // all servers were told of it
  Wrench wrench;                  // of this tick's commands
  bool jointed = false;           // some joint has it as parent or child
  double surge = 0;               // m, SectorWorld::surge() in this tick
  // Where it arrives at the end of this tick, relative to the new home.
  std::optional<BodyState> kinematic_target;
  BodyJoints joints;  // where the server of the new home is another one
};

// The contact points of a pair that is detected in sector `to` from this tick on.
struct ManifoldTransfer {
  SectorIndex to;
  bool was_touching = false;  // so that the contact does not begin again
  ManifoldState manifold;
  bool is_overlap = false;  // no contact: `a` has a trigger, and `b` is in it
};

struct Exchange {
  std::vector<ReplicaIntroduction> introductions;
  std::vector<ReplicaUpdate> replicas;
  std::vector<BodyId> gone;  // no clone of these is needed any longer
  std::vector<Handover> handovers;
  std::vector<ManifoldTransfer> manifolds;
  bool quiet = false;         // nothing of the sender's moves, and nothing in here changes that
  bool has_programs = false;  // the sender hosts some

  bool empty() const {
    return introductions.empty() && replicas.empty() && gone.empty() && handovers.empty() &&
           manifolds.empty();
  }
};

// A server has something for another that does not await it.
struct Call {
  Rank from = 0;
  Rank to = 0;
};

// A body that a joint ties to one that the sender does not know the server of.
struct JointEnd {
  BodyId body;
  BodyId tied;
  Rank host = 0;  // of the body

  friend auto operator<=>(const JointEnd&, const JointEnd&) = default;
};

// Tells a server who hosts a body that a joint ties to one of its own.
struct JointHost {
  Rank to = 0;
  BodyId body;
  Rank host = 0;  // of the body
};

// What all servers agree on before they go on (agreement.h).
struct Agreement {
  bool quiet = true;          // nothing of anybody's moves
  bool goes_on = false;       // somebody has something for others in the next round
  bool has_programs = false;  // somebody hosts some
  std::vector<Call> calls;
  std::vector<JointEnd> joint_ends;  // whose other ends have not been met
  std::vector<JointHost> joint_hosts;
};

struct Transfer {
  std::vector<MovedSector> sectors;
  // For a server that begins to take part: what all know alike and no command tells (lately_heard()).
  std::optional<SharedState> heard;
};

struct Seams {
  std::vector<SectorSeams> sectors;  // those that were awake in this tick, and what islands reach into
};

// A body of a part that is solved elsewhere.
struct ShippedBody {
  BodyId id;
  SectorIndex home;
  SeamStages seam_stages = 0;     // in which it has contacts; of bodies at seams only
  std::uint64_t numbers_end = 0;  // in ShippedIsland::body_numbers
};

// A pair that touches.
struct ShippedPair {
  BodyId a;
  BodyId b;
  std::uint64_t numbers_end = 0;  // in ShippedIsland::pair_numbers
};

// The sender's parts of one island: dynamic bodies, and pairs of these and of what cannot be pushed.
struct ShippedIsland {
  BodyId island;  // the smallest id of its bodies
  std::vector<ShippedBody> bodies;
  std::vector<ShippedPair> pairs;
  // Of each: SectorWorld::append_numbers(), one after the other.
  std::string body_numbers;
  std::string pair_numbers;
  std::vector<JointRecord> joints;  // whose children are among the bodies
};

// Those of one of them; empty where the ends do not say so.
std::string_view numbers_of_body(const ShippedIsland& parcel, std::size_t n);
std::string_view numbers_of_pair(const ShippedIsland& parcel, std::size_t n);

struct Shipment {
  std::vector<ShippedIsland> islands;
  std::vector<ShippedIsland> staged;  // what is at seams of islands that both solve in step
};

// Of the sender's bodies in a stage, in an order that both know.
struct Motions {
  std::string bytes;
};

// What the sender has made of the bodies and pairs of an island, in the order in which they were shipped: for
// SectorWorld::take_solved().
struct SolvedIsland {
  BodyId island;
  std::string bodies;
  std::string pairs;
};

struct Solution {
  std::vector<SolvedIsland> islands;
  // Of bodies that diverged: the joint whose error is largest.
  std::vector<std::pair<BodyId, JointId>> blamed;
  std::vector<std::pair<JointId, JointLoads>> joint_loads;  // of joints that were shipped
};

// Those that servers may have to answer which do not host the program.
struct ProgramAsks {
  bool anybody_asks = false;  // the sender has some, for whomever
  bool has_strays = false;    // it hosts bodies that may be anywhere: Queries::look_for_strays()
  std::vector<ProgramAsk> asks;
};

struct ProgramAnswers {
  std::vector<ProgramFinding> findings;
  std::vector<JointPart> joints;
};

// What a program does at the beginning of the next tick.
struct ProgramAct {
  BodyId by;
  std::uint8_t program = 0;  // its place on the body
  Command command;
};

// A body at the end of a tick.
struct CrossingBody {
  BodyId id;
  SectorIndex home;
  BodyState state;
};

// Bodies of an island that have crossed the border of a frame; they are on the other side from the next tick
// on, if all of the island have.
struct Crossing {
  BodyId island;
  std::uint64_t bodies = 0;  // in all of the island
  FrameNumber frame = kWorldFrame;
  bool comes_in = false;  // into that frame; otherwise, out of it
  std::vector<CrossingBody> crossing;
};

// The bodies aboard a carrier that live on one server, as a tick begins and as it ends.
struct FrameBurden {
  FrameNumber frame = kWorldFrame;
  BurdenSums before;
  BurdenSums after;
  // Of the carrier's centre of mass in the frame, m: from where it lives, if it is dynamic.
  std::optional<Eigen::Vector3d> centre;
};

struct ProgramActs {
  std::vector<ProgramAct> acts;  // in the order of (by, program), and as the program gave them
  std::vector<Crossing> crossings;
  std::vector<CarriedFrame> carried;  // by bodies of the sender, where they have moved
  std::vector<FrameBurden> burdens;
};

using RoundMessage = std::variant<Agreement, Transfer, Exchange, std::shared_ptr<const Seams>, Shipment,
                                  Motions, Solution, ProgramAsks, ProgramAnswers, ProgramActs>;

// An event of a trigger of `a` (lpss/tick/triggers.h), of which nothing after the ids is set; or a contact:
// a patch of contact of two bodies, points that share a normal, reported once, by the sector that detected
// it. The phase is that of the pair, whose patches come in one order; its end is one event without a patch.
struct ContactEvent : ContactPatch {  // not set for kEnd
  Tick tick = 0;
  ContactPhase phase = ContactPhase::kBegin;
  bool trigger = false;
  BodyId a;  // a < b, but for events of triggers
  BodyId b;
};

}  // namespace tessera
