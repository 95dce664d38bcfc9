#include "lpss/tick/homes.h"

#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/tick/inbox.h"
#include "lpss/tick/recipients.h"
#include "lpss/tick/seam_search.h"

namespace tessera {
namespace {

// At rest, at the edge of its sector: a force that stays would otherwise carry it on, tick by tick.
BodyState stopped(BodyState state, double sector_size) {
  for (double& coordinate : state.position) {
    coordinate = std::clamp(coordinate, -sector_size / 2, sector_size / 2);
  }
  state.linear_velocity = {};
  state.angular_velocity = {};
  return state;
}

// Where a body that arrives in `record.home` goes on to in the next tick, if it is fast: it may pass over
// more than a sector in a tick. Its old and its new home find the same.
std::optional<SectorIndex> goes_on_to(const Partition& partition, const BodyRecord& record) {
  const Eigen::Vector3d way = Eigen::Vector3d(record.state.linear_velocity.data()) * partition.dt();
  if (record.properties.motion != Motion::kDynamic || !is_fast(way, partition.margins)) return std::nullopt;
  const std::optional<SectorOffset> offset =
      leaves_home(Eigen::Vector3d(record.state.position.data()) + way, partition.margins);
  const absl::StatusOr<SectorIndex> next = translated(record.home, offset.value_or(SectorOffset{}));
  if (!offset || !next.ok()) return std::nullopt;
  return *next;
}

// Of bodies of some sectors.
struct Decided {
  std::vector<BodyId> leaving;
  std::vector<Stopped> stopped;
};

// A body that would leave the representable world stops here.
void decide_home(const Partition& partition, HomeBody& body, Decided& decided) {
  body.next_home.reset();
  SectorWorld& world = *body.sector->world;
  const std::optional<SectorOffset> offset =
      leaves_home(world.position(body.slot), world.linear_velocity(body.slot) * partition.dt(),
                  body.properties.motion, partition.margins);
  if (!offset) return;
  const absl::StatusOr<SectorIndex> next = translated(body.sector->index, *offset);
  if (!next.ok()) {
    world.set_state(body.slot, stopped(world.state(body.slot), partition.sector_size()));
    body.swept = world.swept_box(body.slot, partition.dt());
    decided.stopped.push_back({body.id, DivergenceKind::kSector});
    return;
  }
  body.next_home = *next;
  decided.leaving.push_back(body.id);
}

}  // namespace

HomeChange taken_to(Partition& partition, HomeBody& body, const SectorIndex& home, const BodyState& state) {
  HomeChange change{{}, body.sector->index, body.known_everywhere};
  Handover& handover = change.handover;
  handover.replicated_in = body.replicated_in;
  handover.wrench = body.sector->world->total_wrench(body.slot);
  handover.surge = body.sector->world->surge(body.slot);
  handover.jointed = body.jointed;
  handover.kinematic_target = body.kinematic_target;
  body.sector->world->set_state(body.slot, state);
  handover.record = remove_home(partition, body);
  handover.record.home = home;
  return change;
}

void forget_moves(Partition& partition, BodyId id) {
  std::erase(partition.leaving, id);
  std::erase(partition.moving_replicas, id);
}

void change_homes(Partition& partition, std::vector<HomeChange> jumps, std::vector<Exchange>& outbox) {
  std::sort(partition.leaving.begin(), partition.leaving.end());
  for (const BodyId id : partition.leaving) {
    HomeBody& body = *partition.bodies.at(id);
    const SectorIndex new_home = *body.next_home;
    const Eigen::Vector3d shift = metres_between(new_home, body.sector->index, partition.sector_size());
    BodyState state = body.sector->world->state(body.slot);
    Eigen::Map<Eigen::Vector3d>(state.position.data()) += shift;
    HomeChange change = taken_to(partition, body, new_home, state);
    if (change.handover.kinematic_target)
      Eigen::Map<Eigen::Vector3d>(change.handover.kinematic_target->position.data()) += shift;
    jumps.push_back(std::move(change));
  }
  const auto everyone_if = [&](bool all) { return all ? everyone(partition.map) : Ranks{}; };
  for (auto& [handover, old_home, was_known_everywhere] : jumps) {
    BodyRecord& record = handover.record;
    const Ranks before =
        everyone_if(was_known_everywhere) | owners(partition.map, old_home, handover.replicated_in);
    const Eigen::AlignedBox3d swept =
        swept_ball(record.state, radius_of(partition, record.properties) + handover.surge, partition.dt());
    handover.replicated_in = partition.rules.sectors_to_tell(
        partition, swept, Eigen::Vector3d(record.state.linear_velocity.data()), handover.surge,
        record.properties.motion);
    handover.known_everywhere =
        is_everywhere(handover.jointed, record.properties.motion, handover.replicated_in);
    announce(
        outbox, record.properties,
        {record.id, record.home, goes_on_to(partition, record).value_or(record.home), handover.replicated_in,
         record.state, handover.known_everywhere, handover.jointed, handover.surge},
        before,
        everyone_if(handover.known_everywhere) | owners(partition.map, record.home, handover.replicated_in));
    const Rank rank = partition.map.owner(record.home);
    if (rank != partition.self) handover.joints = joints_of(partition, record.id);
    outbox[rank].handovers.push_back(std::move(handover));
  }
  partition.leaving.clear();
}

void take_homes(Partition& partition, std::vector<Exchange>& inbox) {
  for (Handover& handover :
       collected(inbox, &Exchange::handovers, [](const Handover& h) { return h.record.id; })) {
    invariant(partition.hosts(handover.record.home),
              "a body is handed to the server that hosts its new home");
    // Awake, so that the new home finds its contacts at once.
    if (handover.record.state.activity == Activity::kAsleep) {
      handover.record.state.activity = Activity::kAwake;
      handover.record.state.still_for = 0;
    }
    take_joints(partition, handover.joints);
    HomeBody& body = add_home(partition, handover.record);
    body.replicated_in = handover.replicated_in;
    body.known_everywhere = handover.known_everywhere;
    body.kinematic_target = handover.kinematic_target;
    if (body.properties.motion == Motion::kDynamic) {
      body.sector->world->set_total_wrench(body.slot, handover.wrench);
      body.sector->world->set_surge(body.slot, handover.surge);
    }
    mark_dirty(body);
    body.swept = body.sector->world->swept_box(body.slot, partition.dt());
    body.next_home = goes_on_to(partition, handover.record);
    if (body.next_home) partition.leaving.push_back(body.id);
  }
  review_joints(partition);
}

void announce_home_changes(Partition& partition, std::vector<Stopped>& stopped, const ParallelFor& parallel) {
  const Pieces pieces(partition.active.size(), kSectorsInPiece);
  std::vector<Decided> decided(pieces.count());
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) {
      for (HomeBody* body : partition.active[n]->attended) {
        if (body->may_have_moved) decide_home(partition, *body, decided[piece]);
      }
    }
  });
  for (const Decided& piece : decided) {
    partition.leaving.insert(partition.leaving.end(), piece.leaving.begin(), piece.leaving.end());
    stopped.insert(stopped.end(), piece.stopped.begin(), piece.stopped.end());
  }
}

}  // namespace tessera
