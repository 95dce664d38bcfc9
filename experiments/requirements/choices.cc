#include "experiments/requirements/choices.h"

#include <absl/container/btree_set.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

absl::btree_set<SectorIndex> sectors_of(const WorldDescription& world) {
  absl::btree_set<SectorIndex> sectors;
  for (const BodyDescription& body : world.bodies) sectors.insert(body.pose.position.sector);
  return sectors;
}

void add_pebbles_in(const absl::btree_set<SectorIndex>& sectors, Motion motion, WorldDescription& world) {
  constexpr double kRadius = 0.1;  // m
  WorldBuilder builder(world.settings);
  builder.world() = std::move(world);
  const ShapeId ball = builder.shape(Sphere{kRadius});
  for (const SectorIndex& sector : sectors) {
    BodyDescription& pebble = builder.add(absl::StrCat("pebble", builder.world().bodies.size()), ball, 1,
                                          Eigen::Vector3d::Zero(), motion);
    pebble.pose.position.sector = sector;
    pebble.properties.category = 0;
    pebble.properties.mask = 0;
  }
  world = std::move(builder.world());
}

}  // namespace

std::vector<Choice> choices_for(const WorldDescription& world) {
  std::vector<Choice> choices = {
      {.name = "sleep", .unmake = [](WorldDescription& w) { w.settings.sleep_after = 0; }},
      {.name = "coast", .free_flight = false},
      {.name = "adapt", .unmake = [](WorldDescription& w) { w.settings.adapt = false; }},
      {.name = "sweep", .unmake = [](WorldDescription& w) { w.settings.continuous_collision = false; }}};
  const bool has_statics = std::ranges::any_of(
      world.bodies, [](const BodyDescription& body) { return body.properties.motion == Motion::kStatic; });
  if (has_statics) return choices;
  choices.push_back({.name = "no-search", .unmake = add_pebbles});
  choices.push_back({.name = "no-world", .unmake = add_keepers});
  return choices;
}

void add_pebbles(WorldDescription& world) { add_pebbles_in(sectors_of(world), Motion::kStatic, world); }

void add_keepers(WorldDescription& world) {
  const absl::btree_set<SectorIndex> inhabited = sectors_of(world);
  if (inhabited.empty()) return;
  SectorIndex low = *inhabited.begin();
  SectorIndex high = low;
  for (const SectorIndex& sector : inhabited) {
    low = {std::min(low.i, sector.i), std::min(low.j, sector.j), std::min(low.k, sector.k)};
    high = {std::max(high.i, sector.i), std::max(high.j, sector.j), std::max(high.k, sector.k)};
  }
  absl::btree_set<SectorIndex> empty;
  for (std::int64_t i = low.i; i <= high.i; ++i) {
    for (std::int64_t j = low.j; j <= high.j; ++j) {
      for (std::int64_t k = low.k; k <= high.k; ++k) {
        if (!inhabited.contains({i, j, k})) empty.insert({i, j, k});
      }
    }
  }
  add_pebbles_in(empty, Motion::kKinematic, world);
}

WorldDescription sparse_world(const WorldSettings& settings, int count) {
  constexpr double kApart = 150;  // m
  WorldBuilder builder(settings);
  builder.world().name = "sparse";
  builder.world().settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  const ShapeId ball = builder.shape(Sphere{0.5});
  const ShapeId brick = builder.shape(Box{{1, 1.4, 0.6}});
  const int side = static_cast<int>(std::ceil(std::cbrt(count)));
  for (int n = 0; n < count; ++n) {
    const Eigen::Vector3d place =
        kApart * Eigen::Vector3i(n % side, n / side % side, n / side / side).cast<double>();
    BodyDescription& body = builder.add(absl::StrCat("body", n), n % 2 == 0 ? ball : brick, 1 + n % 5, place);
    body.linear_velocity = Eigen::Vector3d(n % 7 - 3, n % 5 - 2, n % 11 - 5) * 0.7;
    body.angular_velocity = Eigen::Vector3d(n % 3 - 1, n % 4 - 2, n % 5 - 2) * 1.1;
  }
  return builder.world();
}

absl::Status disturb(WorldDescription& world, double distance) {
  for (BodyDescription& body : world.bodies) {
    distance = -distance;
    if (body.properties.motion != Motion::kDynamic) continue;
    WorldPosition& position = body.pose.position;
    const absl::StatusOr<WorldPosition> moved = canonical(
        position.sector, position.local + Eigen::Vector3d(distance, 0, 0), world.settings.sector_size);
    if (!moved.ok()) return moved.status();
    position = *moved;
  }
  return absl::OkStatus();
}

}  // namespace tessera
