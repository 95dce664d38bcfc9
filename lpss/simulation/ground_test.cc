// Bodies on ground that is made near them.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include "lpss/engine/test_world.h"
#include "lpss/ground/tile_store.h"
#include "lpss/observe/queries.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kEarthRadius = 6371000;  // m

Ground earth() {
  return {.source = Ground::Source::kPlanet,
          .spacing = 16,
          .radius = kEarthRadius,
          .height = 300,
          .wavelength = 4000,
          .octaves = 6,
          .seed = 11};
}

Ground rolling() { return {.spacing = 8, .height = 40, .wavelength = 600, .octaves = 4, .seed = 3}; }

WorldSettings ground_settings() {
  WorldSettings settings;
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{Eigen::Vector3d(0, 0, -9.8)};
  return settings;
}

// Where the ground is, m along z from a point high above it, of a static world.
double height_over(const WorldDescription& world, const Eigen::Vector3d& at, const Eigen::Vector3d& up) {
  const auto cluster = PartitionCluster::create(world, 1).value();
  const double size = world.settings.sector_size;
  const WorldPosition from = canonical(world.anchor, at, size).value();
  const std::optional<RayAnswer> hit = raycast(cluster->partition(0), from, -up, 2000, ~0u);
  return hit ? hit->distance : -1;
}

// Boxes at random places of an Earth, 2 m above the ground, and a stone that hits it at 250 m/s.
WorldDescription earth_world(int boxes) {
  WorldSettings settings = ground_settings();
  settings.gravity = CentralGravity{.surface = 9.8, .radius = kEarthRadius};
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(earth()), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  const WorldDescription bare = builder.world();
  const ShapeId box = builder.shape(Box{{1, 1, 0.5}});
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int n = 0; n < boxes; ++n) {
    const Eigen::Vector3d up = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const Eigen::Vector3d above = up * (kEarthRadius + 400);
    const double clear = height_over(bare, above, up);
    EXPECT_GT(clear, 100);
    EXPECT_LT(clear, 700);
    builder.add(absl::StrCat("box", n), box, 10, above - up * (clear - 2));
  }
  BodyDescription& stone =
      builder.add("stone", builder.shape(Sphere{0.5}), 5, Eigen::Vector3d(kEarthRadius + 500, 0, 0));
  stone.linear_velocity = {-60, 240, 30};
  return builder.world();
}

TEST(GroundWorld, IsTheSameOnAnyNumberOfServersAndThreads) {
  const WorldDescription world = earth_world(6);
  const std::vector<WorldHash> alone = run(world, 1, 1, 300);
  EXPECT_EQ(first_difference(alone, run(world, 4, 1, 300)), 300u);
  EXPECT_EQ(first_difference(alone, run(world, 2, 2, 300)), 300u);
}

TEST(GroundWorld, DoesNotDependOnWhatIsKept) {
  const WorldDescription world = earth_world(3);
  const std::vector<WorldHash> usual = run(world, 1, 1, 200);
  TileStore::of_process().set_options({.bytes_max = 1, .threads = 0});
  EXPECT_EQ(first_difference(usual, run(world, 2, 1, 200)), 200u);
  TileStore::of_process().set_options({});
}

TEST(GroundWorld, IsTheSameAnywhere) {
  WorldDescription world = earth_world(3);
  const std::vector<WorldHash> here = run(world, 1, 1, 200);
  ASSERT_TRUE(move_by(world, {std::int64_t{1} << 60, -(std::int64_t{1} << 61), 12345}).ok());
  EXPECT_EQ(first_difference(here, run(world, 1, 1, 200)), 200u);
}

TEST(GroundWorld, BodiesComeToRestOnIt) {
  auto cluster = cluster_of(earth_world(4), 1);
  for (int tick = 0; tick < 600; ++tick) cluster->step();
  for (std::uint64_t id = 2; id <= 5; ++id) {
    const BodyRecord body = cluster->body(BodyId{id}).value();
    EXPECT_EQ(body.state.activity, Activity::kAsleep);
    const Eigen::Vector3d at = relative_to({body.home, Eigen::Vector3d(body.state.position.data())}, {}, 128);
    EXPECT_GT(at.norm(), kEarthRadius - 300);
  }
}

TEST(GroundWorld, GoesOnFromASnapshot) {
  auto cluster = cluster_of(earth_world(4), 2);
  for (int tick = 0; tick < 60; ++tick) cluster->step();
  auto restored = PartitionCluster::restore(cluster->snapshot(), 3).value();
  for (int tick = 0; tick < 120; ++tick) {
    cluster->step();
    restored->step();
    ASSERT_EQ(cluster->hash(), restored->hash()) << tick;
  }
}

// Gives each tile only once a tick waits for it, or the test is over.
class LateHills final : public TileSource {
 public:
  LateHills() : hills_(make_hills(rolling())) {}
  std::vector<TileKey> overlapping(const Eigen::AlignedBox3d& box) const override {
    return hills_->overlapping(box);
  }
  absl::StatusOr<Tile> make(const TileKey& key) const override {
    while (TileStore::of_process().counts().waiting == 0 && !is_over) std::this_thread::yield();
    return hills_->make(key);
  }

  static inline std::atomic<bool> is_over = false;

 private:
  std::unique_ptr<TileSource> hills_;
};

// Something that flies low and fast over hills, and hits them.
WorldDescription low_flight(const Ground& ground, const Geometry& body) {
  WorldBuilder builder(ground_settings());
  builder.add("ground", builder.shape(ground), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  BodyDescription& flyer = builder.add("flyer", builder.shape(body), 10, {0, 0, 60});
  flyer.linear_velocity = {290, 75, -10};
  return builder.world();
}

TEST(GroundWorld, NothingFallsThroughGroundThatIsLate) {
  TileStore::of_process().set_opener([](const Ground&) { return std::make_unique<LateHills>(); });
  for (const Geometry& body : {Geometry(Sphere{0.25}), Geometry(Box{{2, 1, 0.3}})}) {
    // Another one for each, none of whose tiles are known.
    const Ground late = {.source = Ground::Source::kFolder, .folder = absl::StrCat("late", body.index())};
    const std::uint64_t waits = TileStore::of_process().counts().waits;
    auto on_late = cluster_of(low_flight(late, body), 1);
    auto on_prompt = cluster_of(low_flight(rolling(), body), 1);
    double lowest = 100;
    for (int tick = 0; tick < 600; ++tick) {
      on_late->step();
      on_prompt->step();
      ASSERT_EQ(on_late->hash(), on_prompt->hash()) << tick;
      const BodyRecord flyer = on_late->body(BodyId{2}).value();
      lowest = std::min(lowest,
                        relative_to({flyer.home, Eigen::Vector3d(flyer.state.position.data())}, {}, 128).z());
    }
    EXPECT_GT(lowest, -40) << "it fell through";
    EXPECT_GT(TileStore::of_process().counts().waits, waits + 10);
  }
  LateHills::is_over = true;
  TileStore::of_process().set_opener({});
}

TEST(GroundWorld, IsThereBeforeItIsNeeded) {
  Ground unseen = rolling();  // in other tests
  unseen.seed = 77;
  WorldDescription world = low_flight(unseen, Sphere{0.25});
  world.bodies[1].pose.position = canonical({}, {0, 0, 150}, 128).value();
  world.bodies[1].linear_velocity = {280, 60, 20};
  auto cluster = cluster_of(world, 1);
  cluster->step();
  const TileStore& store = TileStore::of_process();
  const std::uint64_t waits = store.counts().waits;
  const std::uint64_t made = store.counts().made;
  for (int tick = 0; tick < 300; ++tick) {
    cluster->step();
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (store.counts().pending > 0 && std::chrono::steady_clock::now() < deadline)
      std::this_thread::yield();
  }
  EXPECT_EQ(store.counts().waits, waits);
  EXPECT_GT(store.counts().made, made + 20);
}

// Just below the highest summits, where ground may be everywhere.
TEST(GroundWorld, RaysLookForItInSoManySectors) {
  const WorldDescription world = low_flight(rolling(), Sphere{0.25});
  const std::uint64_t made = TileStore::of_process().counts().made;
  for (const std::uint32_t servers : {1, 3}) {
    auto cluster = cluster_of(world, servers);
    for (Rank rank = 0; rank < servers; ++rank) {
      EXPECT_FALSE(raycast(cluster->partition(rank), {{}, {-60, 0, 39.9}}, {1, 0, 0}, 1e6, ~0u));
    }
  }
  EXPECT_LT(TileStore::of_process().counts().made, made + 8 * kRayGroundSectorsMax);
}

TEST(GroundWorld, RefusesWhatCannotBeOpened) {
  const Ground files = {.source = Ground::Source::kFolder, .folder = "nowhere"};
  EXPECT_EQ(Simulation::create(low_flight(files, Sphere{0.25})).status().code(),
            absl::StatusCode::kUnimplemented);
}

}  // namespace
}  // namespace tessera
