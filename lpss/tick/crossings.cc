#include "lpss/tick/crossings.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_motion.h"
#include "lpss/partition/bodies.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

// m, from the surface of the region: above 0 outside of it.
double outside_of(const FrameRegion& region, const Vector3d& place) {
  return ((place - region.centre).cwiseAbs() - region.size / 2).maxCoeff();
}

// A frame with a region, as it is in its parent at the end of a tick.
struct Border {
  FrameNumber frame = kWorldFrame;
  FrameNumber parent = kWorldFrame;
  const FrameRegion* region = nullptr;
  FramePlace place;

  // m, of a point from the centre of the region; axes of the parent. `from`: a sector of it.
  Vector3d from_centre(const SectorIndex& from, const Vector3d& point, double sector_size) const {
    return metres_between(place.origin.sector, from, sector_size) + (point - place.origin.local) -
           place.orientation * region->centre;
  }
  bool contains(const Vector3d& from_centre) const {
    const Vector3d along_axes = place.orientation.conjugate() * from_centre;
    return outside_of(*region, region->centre + along_axes) < -kRegionHysteresis;
  }
};

bool touches_what_is_fixed(const Partition& partition, const Sector& sector, const Component& component) {
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
    const ContactPair& pair = pairs[sector.component_pairs[i]];
    if (motion_of(partition, pair.a) != Motion::kDynamic || motion_of(partition, pair.b) != Motion::kDynamic)
      return true;
  }
  return false;
}

bool is_joined_to_what_is_fixed(const Partition& partition, const HomeBody& body) {
  return body.jointed && std::ranges::any_of(partition.joints.of(body.id), [&](JointId id) {
           return partition.joints.find(id)->parent_motion != Motion::kDynamic;
         });
}

// At the end of a tick: of a frame with a carrier, as far as it is known before others tell.
absl::StatusOr<FramePlace> place_of(const Partition& partition, FrameNumber frame, Tick tick, bool is_told) {
  const auto carried = std::ranges::find(partition.carried, frame, &CarriedFrame::frame);
  if (carried == partition.carried.end())
    return frame_place(partition.settings, frame, static_cast<double>(tick) * partition.dt());
  FramePlace place = carried->place;
  if (is_told) return place;
  const double dt = partition.dt();
  place.velocity += carried->acceleration * dt;
  place.spin += carried->angular_acceleration * dt;
  place.orientation = (rotation_by(place.spin * dt) * place.orientation).normalized();
  absl::StatusOr<WorldPosition> origin =
      canonical(place.origin.sector, place.origin.local + place.velocity * dt, partition.sector_size());
  if (!origin.ok()) return origin.status();
  place.origin = *origin;
  return place;
}

absl::StatusOr<FramedBody> across(const FramePlace& place, FrameNumber frame, bool comes_in,
                                  const FramedBody& body, double sector_size) {
  return comes_in ? into_frame(place, frame, body, sector_size) : out_of_frame(place, body, sector_size);
}

double speed_of(const BodyState& state) { return Vector3d(state.linear_velocity.data()).norm(); }

// The crossings of one partition in one tick.
class Crossings {
 public:
  Crossings(const Partition& partition, Tick tick) : partition_(partition), size_(partition.sector_size()) {
    const std::vector<MovingFrame>& frames = partition.settings.frames;
    for (FrameNumber frame = 1; frame <= frames.size(); ++frame) {
      if (!frames[frame - 1].region) continue;
      const absl::StatusOr<FramePlace> place = place_of(partition, frame, tick, /*is_told=*/false);
      if (place.ok())
        borders_.push_back({frame, frames[frame - 1].parent(), &*frames[frame - 1].region, *place});
    }
  }

  void look_at(const Sector& sector, std::vector<Crossing>& crossings) {
    find_near(sector);
    if (near_.empty()) return;
    for (const Component& component : sector.components) {
      if (std::optional<Crossing> crossing = crossing_of(sector, component))
        crossings.push_back(*std::move(crossing));
    }
  }

 private:
  // The borders that bodies of the sector may have crossed.
  void find_near(const Sector& sector) {
    near_.clear();
    // Bodies are on their way to the next sector, which is beside this one unless they are fast.
    const double reach = 1.5 * std::sqrt(3.0) * size_;
    const bool is_fast = std::ranges::any_of(sector.homes, [&](const HomeBody* body) {
      return sector.world->position(body->slot).cwiseAbs().maxCoeff() > size_;
    });
    for (const Border& border : borders_) {
      if (border.frame == sector.index.frame) {
        near_.push_back(&border);
      } else if (border.parent != sector.index.frame) {
        continue;
      } else if (is_fast || border.from_centre(sector.index, Vector3d::Zero(), size_).norm() <
                                reach + border.region->size.norm() / 2) {
        near_.push_back(&border);
      }
    }
  }

  // The border that a body of a sector has crossed, which has those that are near; null if it stays.
  const Border* crossed_by(const Sector& sector, const HomeBody& body) const {
    const Vector3d position = sector.world->position(body.slot);
    for (const Border* border : near_) {
      if (sector.index.frame == border->parent) {
        if (border->contains(border->from_centre(sector.index, position, size_))) return border;
      } else {
        const Vector3d place = metres_between({0, 0, 0, border->frame}, sector.index, size_) + position;
        if (outside_of(*border->region, place) >= kRegionHysteresis) return border;
      }
    }
    return nullptr;
  }

  std::optional<Crossing> crossing_of(const Sector& sector, const Component& component) const {
    const std::span<HomeBody* const> bodies(sector.component_bodies.data() + component.bodies_begin,
                                            component.bodies_end - component.bodies_begin);
    const Border* const border = crossed_by(sector, *bodies.front());
    if (border == nullptr) return std::nullopt;
    const bool comes_in = sector.index.frame == border->parent;
    const bool is_held = touches_what_is_fixed(partition_, sector, component);
    Crossing crossing{bodies.front()->id, bodies.size(), border->frame, comes_in, {}};
    for (const HomeBody* body : bodies) {
      const bool stays =
          sector.world->activity(body->slot) == Activity::kAsleep || crossed_by(sector, *body) != border ||
          is_joined_to_what_is_fixed(partition_, *body) || carries_a_frame(partition_.settings, body->id);
      if (stays) return std::nullopt;
      const FramedBody now{sector.index, sector.world->state(body->slot)};
      const absl::StatusOr<FramedBody> then = across(border->place, border->frame, comes_in, now, size_);
      const double bound =
          is_held || (comes_in && !body->programs.empty()) ? speed_of(now.state) + kBoardingSpeed : kSpeedMax;
      if (!then.ok() || speed_of(then->state) > std::min(bound, kSpeedMax)) return std::nullopt;
      crossing.crossing.push_back({body->id, now.home, now.state});
    }
    if (component.part == Component::kInterior) return crossing;
    const SeamIsland island =
        partition_.seam_graph.island_of({sector.index, static_cast<std::uint32_t>(component.part)});
    crossing.island = island.id;
    crossing.bodies = island.bodies;
    return crossing;
  }

  const Partition& partition_;
  double size_;
  std::vector<Border> borders_;
  std::vector<const Border*> near_;  // those of the sector that is looked at
};

}  // namespace

bool may_cross(const Partition& partition) {
  return !partition.active.empty() &&
         std::ranges::any_of(partition.settings.frames,
                             [](const MovingFrame& frame) { return frame.region.has_value(); });
}

void append_crossings(const Partition& partition, Tick tick, ProgramActs& acts) {
  if (!may_cross(partition)) return;
  Crossings crossings(partition, tick);
  for (const Sector* sector : partition.active) {
    if (sector->world && !sector->components_stale) crossings.look_at(*sector, acts.crossings);
  }
}

std::vector<Teleport> agreed_jumps(const Partition& partition, Tick tick, std::vector<Crossing> crossings) {
  const auto order = [](const Crossing& crossing) {
    return std::tuple(crossing.island, crossing.frame, crossing.comes_in);
  };
  std::ranges::stable_sort(crossings, {}, order);
  std::vector<Teleport> jumps;
  for (auto part = crossings.begin(); part != crossings.end();) {
    const auto end = std::ranges::find_if(
        part, crossings.end(), [&](const Crossing& other) { return order(other) != order(*part); });
    const absl::StatusOr<FramePlace> place = place_of(partition, part->frame, tick, /*is_told=*/true);
    const std::uint64_t bodies = part->bodies;
    std::vector<Teleport> island;
    for (; part != end; ++part) {
      for (const CrossingBody& body : part->crossing) {
        if (!place.ok()) continue;
        const absl::StatusOr<FramedBody> then =
            across(*place, part->frame, part->comes_in, {body.home, body.state}, partition.sector_size());
        if (!then.ok()) continue;
        Teleport& jump = island.emplace_back(Teleport{body.id, then->home, then->state});
        jump.keeps_contacts = true;
      }
    }
    if (island.size() == bodies) std::ranges::move(island, std::back_inserter(jumps));
  }
  std::ranges::sort(jumps, {}, [](const Teleport& jump) { return jump.id; });
  return jumps;
}

}  // namespace tessera
