#include "lpss/tick/frames.h"

#include <algorithm>
#include <utility>

#include "lpss/partition/bodies.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

std::vector<SectorIndex> sectors_in(const Partition& partition, FrameNumber frame) {
  std::vector<SectorIndex> sectors;
  for (const auto& [index, sector] : partition.sectors) {
    if (index.frame == frame) sectors.push_back(index);
  }
  partition.packed.for_each([&](const SectorIndex& index, std::size_t) {
    if (index.frame == frame) sectors.push_back(index);
  });
  std::ranges::sort(sectors);
  return sectors;
}

void wake_all(Partition& partition, FrameNumber frame) {
  for (const SectorIndex& index : sectors_in(partition, frame)) {
    bring_back(partition, index);
    Sector& sector = *partition.sectors.at(index);
    for (HomeBody* body : sector.homes) {
      if (body->properties.motion == Motion::kDynamic &&
          sector.world->activity(body->slot) == Activity::kAsleep)
        wake_home(partition, *body);
    }
  }
}

// A carrier turns at times, and at others it does not: what is aboard is told how it flies in either case.
bool may_turn(const Partition& partition, const Sector& sector) {
  const FrameNumber frame = sector.index.frame;
  return partition.felt_in(sector.index).turns() ||
         (frame != kWorldFrame && partition.settings.frames[frame - 1].carrier);
}

// The innermost frame with a carrier that this one moves in; the world frame if there is none.
FrameNumber carried_around(const WorldSettings& settings, FrameNumber frame) {
  FrameNumber around = settings.frames[frame - 1].parent();
  while (around != kWorldFrame && !settings.frames[around - 1].carrier)
    around = settings.frames[around - 1].parent();
  return around;
}

void feel(const Partition& partition, Sector& sector, const HomeBody& body) {
  if (body.properties.motion != Motion::kDynamic) return;
  const Felt& felt = partition.felt_in(sector.index);
  const Vector3d position = sector.world->position(body.slot);
  const bool has_gravity = body.properties.gravity;
  sector.world->set_gravity(body.slot, felt.at(sector.index, position, has_gravity));
  if (!may_turn(partition, sector)) return;
  const BodyState state = sector.world->state(body.slot);
  const Vector3d velocity(state.linear_velocity.data());
  const Eigen::Matrix3d axes = quaternion_of(state).toRotationMatrix();
  const Eigen::Matrix3d inertia =
      axes * Vector3d(body.properties.inertia.data()).asDiagonal() * axes.transpose();
  const Felt::Flight flight = felt.flight(sector.index, position, velocity, has_gravity);
  sector.world->set_turning(
      body.slot, {felt.coriolis(velocity), felt.torque(inertia, Vector3d(state.angular_velocity.data())),
                  felt.spin(), flight.way, flight.change});
}

}  // namespace

void append_carried(const Partition& partition, ProgramActs& acts) {
  for (const CarriedFrame& before : partition.carried) {
    const MovingFrame& frame = partition.settings.frames[before.frame - 1];
    const auto found = partition.bodies.find(frame.carrier->body);
    // A program may have taken it into another frame, where its own frame does not follow.
    if (found == partition.bodies.end() || found->second->sector->index.frame != frame.parent()) continue;
    const HomeBody& body = *found->second;
    const absl::StatusOr<CarriedFrame> now =
        carried_on(partition.settings, before, record_of(body), body.kinematic_target.has_value());
    if (now.ok() && *now != before) acts.carried.push_back(*now);
  }
}

void take_carried(Partition& partition, const std::vector<ProgramActs>& acts) {
  for (const ProgramActs& some : acts) {
    for (const CarriedFrame& now : some.carried) {
      const auto known = std::ranges::find(partition.carried, now.frame, &CarriedFrame::frame);
      if (known != partition.carried.end()) *known = now;
    }
  }
}

void halt_carried(Partition& partition, BodyId carrier) {
  for (CarriedFrame& carried : partition.carried) {
    if (partition.settings.frames[carried.frame - 1].carrier->body != carrier) continue;
    CarriedFrame still;
    still.frame = carried.frame;
    still.place.origin = carried.place.origin;
    still.place.orientation = carried.place.orientation;
    carried = still;
  }
}

bool begin_frames(Partition& partition, Tick tick) {
  if (partition.settings.frames.empty()) return false;
  const std::vector<Felt> before =
      std::exchange(partition.felt, felt_in_frames(partition.settings, tick, partition.carried));
  std::vector<bool> is_changed(partition.felt.size());
  for (FrameNumber frame = kWorldFrame + 1; frame < partition.felt.size(); ++frame) {
    if (!partition.felt[frame].is_as(before[frame])) ++partition.felt_changes[frame];
    const auto carried = std::ranges::find(partition.carried, frame, &CarriedFrame::frame);
    const bool is_carried = carried != partition.carried.end();
    const auto& now = partition.felt[frame].steps();
    auto last = is_carried ? std::exchange(carried->felt, now) : before[frame].steps();
    const FrameNumber around = carried_around(partition.settings, frame);
    // What was felt before is not in snapshots: as the carrier is now, a tick earlier.
    if (around != kWorldFrame && !is_carried) {
      const double time = static_cast<double>(tick - std::min<Tick>(tick, 2)) * partition.dt();
      last = Felt(partition.settings, frame, time, partition.carried).steps();
    }
    is_changed[frame] = now != last || (around != kWorldFrame && is_changed[around]);
    if (is_changed[frame]) wake_all(partition, frame);
  }
  return std::ranges::find(is_changed, true) != is_changed.end();
}

void set_felt(Partition& partition, Tick tick) {
  partition.felt = felt_in_frames(partition.settings, tick, partition.carried);
  for (std::uint64_t& changes : partition.felt_changes) ++changes;
}

// What they have felt stays with bodies. Those at rest have it from when it last changed: by less than wakes
// them.
void feel(const Partition& partition, Sector& sector, const ParallelFor& parallel) {
  const std::uint64_t changes = partition.felt_changes[sector.index.frame];
  const bool is_known = std::exchange(sector.felt_changes, changes) == changes;
  if (is_known && partition.felt_in(sector.index).is_uniform() && !may_turn(partition, sector)) return;
  run_in_pieces(parallel, sector.homes.size(), kBodiesInPiece, [&](std::size_t n) {
    const HomeBody& body = *sector.homes[n];
    if (!is_known || sector.world->activity(body.slot) != Activity::kAsleep) feel(partition, sector, body);
  });
}

}  // namespace tessera
