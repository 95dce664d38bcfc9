#include "lpss/tick/frames.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "lpss/model/frame_motion.h"
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
      if (body->properties.motion != Motion::kDynamic ||
          sector.world->activity(body->slot) != Activity::kAsleep)
        continue;
      sector.world->wake(body->slot);
      mark_dirty(*body);
      activate(partition, sector);
    }
  }
}

void feel(const Partition& partition, Sector& sector, const HomeBody& body) {
  if (body.properties.motion != Motion::kDynamic) return;
  const Felt& felt = partition.felt_in(sector.index);
  const BodyState state = sector.world->state(body.slot);
  const Vector3d position(state.position.data());
  const Vector3d velocity(state.linear_velocity.data());
  const bool has_gravity = body.properties.gravity;
  const Vector3d still = felt.at(sector.index, position, has_gravity);
  sector.world->set_gravity(body.slot, still);
  if (!felt.turns()) return;
  const Eigen::Matrix3d axes = quaternion_of(state).toRotationMatrix();
  const Eigen::Matrix3d inertia =
      axes * Vector3d(body.properties.inertia.data()).asDiagonal() * axes.transpose();
  const Felt::Flight flight = felt.flight(sector.index, position, velocity, has_gravity);
  sector.world->set_turning(
      body.slot, {felt.coriolis(velocity), felt.torque(inertia, Vector3d(state.angular_velocity.data())),
                  flight.way, flight.change});
}

// m, from the surface of the region: above 0 outside of it.
double outside_of(const FrameRegion& region, const Vector3d& place) {
  return ((place - region.centre).cwiseAbs() - region.size / 2).maxCoeff();
}

std::optional<FramedBody> crossed_at(const Partition& partition, double time, const FramedBody& now) {
  const WorldSettings& settings = partition.settings;
  const double size = partition.sector_size();
  if (now.home.frame != kWorldFrame) {
    const std::optional<FrameRegion>& region = settings.frames[now.home.frame - 1].region;
    if (!region || outside_of(*region, place_in_frame(now, size)) < kRegionHysteresis) return std::nullopt;
    const absl::StatusOr<FramedBody> out = out_of_frame(settings, time, now);
    // What is faster than the world frame bears stays where it is.
    if (!out.ok() || Vector3d(out->state.linear_velocity.data()).norm() > kSpeedMax) return std::nullopt;
    return *out;
  }
  for (FrameNumber number = 1; number <= settings.frames.size(); ++number) {
    const std::optional<FrameRegion>& region = settings.frames[number - 1].region;
    if (!region) continue;
    const absl::StatusOr<FramedBody> in = into_frame(settings, number, time, now);
    if (in.ok() && outside_of(*region, place_in_frame(*in, size)) < -kRegionHysteresis) return *in;
  }
  return std::nullopt;
}

}  // namespace

bool may_cross(const Partition& partition) {
  return !partition.active.empty() &&
         std::ranges::any_of(partition.settings.frames,
                             [](const MovingFrame& f) { return f.region.has_value(); });
}

void append_crossings(const Partition& partition, Tick tick, ProgramActs& acts) {
  if (!may_cross(partition)) return;
  const double time = static_cast<double>(tick) * partition.dt();
  for (const Sector* sector : partition.active) {
    for (const HomeBody* body : sector->homes) {
      if (body->properties.motion != Motion::kDynamic || body->jointed || !sector->world->flew(body->slot) ||
          sector->world->activity(body->slot) == Activity::kAsleep)
        continue;
      const FramedBody now{sector->index, sector->world->state(body->slot)};
      const std::optional<FramedBody> crossed = crossed_at(partition, time, now);
      if (!crossed) continue;
      Teleport jump{body->id, crossed->home, crossed->state};
      acts.acts.push_back({body->id, 0, jump});
    }
  }
  std::ranges::stable_sort(acts.acts, {},
                           [](const ProgramAct& act) { return std::pair(act.by, act.program); });
}

bool begin_frames(Partition& partition, Tick tick) {
  if (partition.settings.frames.empty()) return false;
  const std::vector<Felt> before = std::exchange(partition.felt, felt_in_frames(partition.settings, tick));
  bool is_changed = false;
  for (FrameNumber frame = kWorldFrame + 1; frame < partition.felt.size(); ++frame) {
    if (!partition.felt[frame].is_as(before[frame])) ++partition.felt_changes[frame];
    if (!partition.felt[frame].wakes_after(before[frame])) continue;
    is_changed = true;
    wake_all(partition, frame);
  }
  return is_changed;
}

void set_felt(Partition& partition, Tick tick) {
  partition.felt = felt_in_frames(partition.settings, tick);
  for (std::uint64_t& changes : partition.felt_changes) ++changes;
}

// What they have felt stays with bodies. Those at rest have it from when it last changed: by less than wakes
// them.
void feel(const Partition& partition, Sector& sector, const ParallelFor& parallel) {
  const std::uint64_t changes = partition.felt_changes[sector.index.frame];
  const bool is_known = std::exchange(sector.felt_changes, changes) == changes;
  if (is_known && partition.felt_in(sector.index).is_uniform()) return;
  run_in_pieces(parallel, sector.homes.size(), kBodiesInPiece, [&](std::size_t n) {
    const HomeBody& body = *sector.homes[n];
    if (!is_known || sector.world->activity(body.slot) != Activity::kAsleep) feel(partition, sector, body);
  });
}

}  // namespace tessera
