// A server's share of a world: the sectors that it hosts, and the tick as a state machine without I/O.
//
// One process that hosts everything has one share (rank 0 of 1) and hands its own messages back to it; n
// servers have n shares and carry the messages. Both run this code, and end in the same bits.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "lpss/tick/parallel.h"
#include "lpss/engine/engine.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/world_description.h"
#include "lpss/observe/world_hash.h"
#include "lpss/partition/joint_index.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/seam_graph.h"
#include "lpss/partition/sector.h"
#include "lpss/partition/static_index.h"
#include "lpss/tick/coupled_part.h"
#include "lpss/tick/island_assembly.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/phase_clock.h"

namespace tessera {

// What a share counted in one tick. Sums over all shares do not depend on how many there are.
struct TickCounts {
  std::uint32_t sectors = 0;  // with a body that lives there, static ones not counted
  std::uint32_t sectors_awake = 0;
  std::uint32_t bodies_awake = 0;
  std::uint32_t clones = 0;                // in engine worlds
  std::uint32_t contacts = 0;              // pairs in awake sectors
  std::uint32_t islands_across_seams = 0;  // solved by this share, with bodies of more than one sector
  std::uint32_t islands_shipped = 0;       // of those, with bodies of more than one server
  std::uint32_t islands_cut = 0;           // beyond the cap: not solved whole, but coupled pass by pass
  std::uint32_t bodies_stopped = 0;        // left the range of numbers or sectors, and were stopped

  TickCounts& operator+=(const TickCounts& other);
};

// What a share says in one round of a tick, and whom it must hear before it goes on.
struct Round {
  std::uint32_t number = 0;                     // the same for all that send and await it
  std::vector<std::optional<RoundMessage>> to;  // by rank; to itself, too
  std::vector<bool> from;                       // by rank: who sends something in this round
};

class Share {
 public:
  struct Options {
    WorldSettings settings;
    SectorIndex anchor;
    SectorMap map;
    Rank self = 0;
    ParallelFor parallel;  // empty: one after the other
    TimeSource time{};     // empty: phases are not timed
    // Without a solver; what comes out is the same, but for the fine digits of orbits.
    bool lone_bodies_coast = true;
  };

  // `engine` must have been made for the settings (see engine_settings()) and outlive the share.
  Share(Options options, Engine& engine);
  ~Share();

  // --- before the first tick ---

  void add_shape(ShapeId id, const Shape& shape);

  // Static bodies: all of the world, on every share. Others: those whose home this share hosts.
  void add_body(const BodyRecord& record);

  // The largest radius (m) of a body that can move, of the whole world: what decides how near to a seam is
  // near. Needed where add_body() is not told of all of them.
  void expect_radius(double radius);

  // A joint between bodies of the world, wherever they live: on every share.
  void add_joint(const JointRecord& record);

  // --- the tick: rounds of messages (messages.h), until a call returns nothing ---

  // Starts a tick. All shares get all commands, which take effect at once. Nothing to say, and the tick is
  // over, where the whole world is at rest.
  std::optional<Round> begin_tick(std::span<const Command> commands);

  // Goes on with what the ranks in the last round's `from` sent in that round.
  std::optional<Round> advance(std::vector<std::optional<RoundMessage>> inbox);

  // --- between ticks ---

  const TickCounts& counts() const { return counts_; }

  // Of the last tick, without the time between the calls; zero without a time source.
  const PhaseTimes& phase_times() const { return phase_clock_.times(); }

  // Of the bodies that this share hosts; sums over all shares are the world's.
  WorldHash hash() const;

  // Calls `visit(const BodyRecord&)` for each dynamic and kinematic body, in ascending order of ids.
  void for_each_body(const std::function<void(const BodyRecord&)>& visit) const;
  // Likewise of the sectors that `wants` names: sector by sector, which is faster, ascending within each.
  void for_each_body(const std::function<bool(const SectorIndex&)>& wants,
                     const std::function<void(const BodyRecord&)>& visit) const;
  std::size_t body_count() const { return bodies_.size(); }
  // Nothing where the body lives elsewhere, or is static.
  std::optional<BodyRecord> body(BodyId id) const;

  // Contact events of the last tick, ascending by (a, b); only gathered while switched on.
  void report_contacts(bool on);
  const std::vector<ContactEvent>& contact_events() const { return events_; }

  // The nearest hit of a ray (m, `direction` of unit length) in the sectors of this share. Static bodies
  // count in the sectors that the ray passes through. `distance` is in m from `origin`.
  struct RayAnswer {
    BodyId body;
    double distance = 0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  };
  std::optional<RayAnswer> raycast(const WorldPosition& origin, const Eigen::Vector3d& direction,
                                   double length, std::uint32_t mask);

  // The bodies of this share's sectors, and statics in them, within `reach` (m) of a convex `probe` at
  // `pose`, in ascending order of (distance, id). A static body may be found by several shares; the smallest
  // distance counts.
  std::vector<NearBody> near(const Geometry& probe, const WorldPose& pose, double reach, std::uint32_t mask);

  // Copies of bodies in the engine worlds of this share's sectors, ascending by body and sector.
  struct CloneAt {
    BodyId body;
    WorldPosition position;  // of its centre of mass, in the sector that it visits
  };
  std::vector<CloneAt> clones() const;

  // Awake islands that reach over borders, ascending by name (the smallest id of all their bodies), with
  // those of their bodies that live here, ascending.
  struct IslandHere {
    BodyId name;
    std::vector<BodyId> bodies;
  };
  std::vector<IslandHere> islands_across_seams() const;

  const Options& options() const { return options_; }
  const StaticIndex& statics() const { return statics_; }
  const JointIndex& joints() const { return joints_; }

 private:
  bool mine(const SectorIndex& sector) const { return options_.map.owner(sector) == options_.self; }
  double dt() const { return options_.settings.time_step; }
  double size() const { return options_.settings.sector_size; }

  // share_rounds.cc
  enum class Phase { kIdle, kTransfer, kExchange, kSeams, kShipment, kSolution, kCoupling };
  Round round(Phase phase, std::uint32_t pass = 0);
  std::optional<Round> exchange();
  Round seams_round(std::vector<Exchange> inbox);
  Round shipment_round(const std::vector<const Seams*>& inbox);
  Round after_shipments(std::vector<Shipment> inbox);
  Round coupling_round();
  Round after_coupling(std::vector<Coupling> inbox);
  Round solution_round();
  void rest();

  // share_transfer.cc
  bool shuffles() const;
  std::vector<Transfer> give_sectors_away();
  void take_sectors(std::vector<Transfer> inbox);
  MovedSector pack_sector(const Sector& sector) const;
  void forget_sector(Sector& sector);
  void unpack_bodies(const MovedSector& moved);
  void unpack_clones(const MovedSector& moved);
  void unpack_contacts(const MovedSector& moved);

  // share_joints.cc
  void remove_joint(JointId id);
  void remove_joints_of(BodyId body);
  void set_drives(const SetDrives& command);
  void wake_jointed(const JointRecord& joint);
  void note_joint(BodyId body);
  bool is_everywhere(const HomeBody& body) const;
  bool is_pushed_by(const JointRecord& joint) const;
  bool is_dynamic(BodyId body, const JointRecord& joint) const;
  void link_joints(const Sector& sector, const Component& component, std::vector<BodyId>& links) const;
  std::vector<BodyId> far_parents(const Sector& sector, const Component& component) const;
  void fix_parent(const JointRecord& joint, const SectorIndex& frame, TaskJoint& task) const;
  SolveJob built(TaskBuilder& builder) const;

  // share_bodies.cc: sectors and what is in them
  Sector& sector_at(const SectorIndex& index);
  SectorWorld& world_of(Sector& sector);
  void add_static(Sector& sector, BodyId id);
  void add_statics(Sector& sector, const Eigen::AlignedBox3d& box);
  HomeBody& add_home(const BodyRecord& record);
  BodyRecord remove_home(HomeBody& body);
  void drop_if_empty(Sector& sector);
  void activate(Sector& sector);
  void wake_touching(Sector& sector, BodySlot slot);
  void remove_static(BodyId id);
  void spawn_static(const BodyRecord& record);
  void know_radius(const BodyProperties& properties);
  double radius_of(const BodyProperties& properties) const;
  BodyRecord record_of(const HomeBody& body) const;

  // share_queries.cc
  SectorWorld* world_to_ask(const SectorIndex& index, const Eigen::AlignedBox3d& surroundings,
                            Sector& passing);
  void raycast_sector(const SectorIndex& index, const WorldPosition& origin, const Eigen::Vector3d& direction,
                      double length, std::uint32_t mask, std::optional<RayAnswer>& nearest);

  // share_commands.cc
  void apply(const Command& command);
  void lift_clones(BodyId id);
  void forget_moves(BodyId id);
  void remove(BodyId id);
  void teleport(const Teleport& jump);
  void set_goal(const KinematicTarget& target);

  // share_exchange.cc
  std::vector<Exchange> tell_of_seams();
  OffsetSet sectors_to_tell(const Eigen::AlignedBox3d& swept, Motion motion) const;
  void export_manifolds(std::vector<Exchange>& outbox);
  void move_homes(std::vector<Exchange>& outbox);
  void announce(HomeBody& body);
  void deepen_clones(Sector& sector);
  void update_ghosts(HomeBody& body, std::vector<Exchange>& outbox);
  void take_ghosts(std::vector<Exchange>& inbox);
  Ghost& introduce(const BodyIntroduction& news);
  static void revise(Ghost& ghost, const GhostUpdate& update);
  void place_ghost(Ghost& ghost);
  void forget_ghost(BodyId id);
  void take_handovers(std::vector<Exchange>& inbox);
  void take_manifolds(std::vector<Exchange>& inbox);
  void refresh_clones(Sector& sector);
  bool supports_clones(const Sector& sector) const;
  bool is_jointed_here(BodyId id, const Sector& sector) const;
  BodyRecord seen_in(const Sector& sector, const Ghost& ghost) const;
  void place_clone(Sector& sector, Clone& clone);
  void pull_clone(Sector& sector, const Clone& clone);
  void unplace_clone(Sector& sector, Clone& clone);
  void take_out(Sector& sector, Clone& clone);
  void displace(BodyId id, const SectorIndex& place);
  Motion motion_of(BodyId id) const;
  const SectorIndex& next_home(BodyId id) const;
  bool lives_in(BodyId id, const Sector& sector) const;

  // share_detect.cc
  Seams detect(std::vector<Exchange> inbox);
  void reach_statics(Sector& sector);
  bool anything_awake(const Sector& sector) const;
  void pull(Sector& sector);
  void find_components(Sector& sector);
  void list_lone_bodies(Sector& sector);
  void list_parts(Sector& sector);

  // share_solve.cc
  struct PendingIsland {  // waits for the parts that other servers ship
    BodyId name;
    TaskBuilder builder;
    absl::flat_hash_map<BodyId, BodyRecord> own;
  };
  std::vector<Shipment> join(const std::vector<const Seams*>& inbox);
  std::vector<Solution> solve(std::vector<Shipment> inbox);
  Rank solver_of(const SeamIsland& island, const std::vector<std::uint64_t>& weight) const;
  void settle(Sector& sector, const Component& component, bool all_drowsy);
  bool is_lone(const Sector& sector, const Component& component) const;
  void contribute(Sector& sector, const Component& component, TaskBuilder& builder, bool clones_as_bodies);
  void assemble_interior(Sector& sector);
  void assemble(const SeamIsland& island, std::vector<Shipment>& outbox);
  void pack(Sector& sector, const Component& component, ShippedIsland& parcel);
  void run_jobs();

  // share_couple.cc
  bool beyond_cap(const SeamIsland& island) const;
  void couple(const SeamIsland& island, std::vector<Shipment>& outbox);
  void begin_parts(const std::vector<Shipment>& inbox);
  std::vector<Coupling> changes_of_parts() const;
  void agree(const std::vector<Coupling>& inbox);

  // share_finish.cc
  void finish(std::vector<Solution> inbox);
  void move_kinematics(Sector& sector);
  std::uint32_t stop_runaways(Sector& sector);
  void gather_events(Sector& sector, std::vector<ContactEvent>& events);
  bool reports(const Sector& sector, const ContactPair& pair) const;
  void take_solution(const Solution& solution);
  void count();

  void run_parallel(std::size_t count, const std::function<void(std::size_t)>& body);

  Options options_;
  Engine& engine_;
  Tick tick_ = 0;
  Phase phase_ = Phase::kIdle;
  PhaseClock phase_clock_;
  bool at_rest_ = false;           // nothing in the whole world moves
  std::vector<Command> commands_;  // of this tick
  SeamMargins margins_;
  double radius_max_ = 0;
  absl::btree_map<ShapeId, std::unique_ptr<Shape>> shapes_;
  StaticIndex statics_;
  JointIndex joints_;

  absl::flat_hash_map<SectorIndex, std::unique_ptr<Sector>> sectors_;
  absl::flat_hash_map<BodyId, std::unique_ptr<HomeBody>> bodies_;
  absl::flat_hash_map<BodyId, std::unique_ptr<Ghost>> ghosts_;
  std::size_t worlds_ = 0;             // sectors with an engine world
  std::size_t clones_ = 0;             // in engine worlds, at the last detection
  std::vector<Sector*> active_;        // sectors to step; sorted before use
  std::vector<BodyId> leaving_;        // own bodies whose announced move takes effect at the next tick
  std::vector<BodyId> moving_ghosts_;  // ghosts whose home changes at the next tick
  // Bodies that commands of this tick put elsewhere, with their old homes; the targets are still the old
  // ones.
  std::vector<std::pair<Handover, SectorIndex>> jumps_;
  std::vector<SectorIndex> vacated_;  // sectors that lost their last body in this tick
  bool margins_changed_ = false;

  std::vector<Sector*> stepped_;  // sectors that take part in this tick
  SeamGraph seam_graph_;
  std::vector<SolveJob> jobs_;
  std::vector<PendingIsland> pending_;
  std::vector<CoupledPart> coupled_;
  std::vector<bool> coupled_with_;  // by rank: whose parts share bodies with ours
  std::uint32_t pass_ = 0;          // of the coupled parts
  std::vector<Solution> solutions_;
  std::vector<bool> awaits_shipment_;
  std::vector<bool> awaits_solution_;
  SolverPool solvers_;

  bool report_contacts_ = false;
  std::vector<ContactEvent> events_;
  std::vector<std::pair<BodyId, BodyId>> ended_;  // contacts whose sector has come to its end
  TickCounts counts_;
};

// The engine settings that a world's settings ask for.
EngineSettings engine_settings(const WorldSettings& settings);

}  // namespace tessera
