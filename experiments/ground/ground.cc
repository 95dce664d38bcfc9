#include "experiments/ground/ground.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include "cli/measure/stopwatch.h"
#include "experiments/heap.h"
#include "experiments/local_servers.h"
#include "lpss/ground/tile_store.h"
#include "lpss/observe/queries.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {
namespace {

constexpr double kGlobeRadius = 6371000;  // m
constexpr double kSummits = 250;          // m
constexpr double kGlobeSpeed = 250;       // m/s
constexpr double kDropHeight = 2;         // m, over the ground, from which boxes fall
constexpr Tick kTicksPerSecond = 60;
constexpr Tick kSettleTicks = kTicksPerSecond;
constexpr double kMegabyte = 1e6;

Ground globe(std::uint64_t seed) {
  return {.source = Ground::Source::kPlanet,
          .spacing = 16,
          .radius = kGlobeRadius,
          .height = kSummits,
          .wavelength = 5000,
          .octaves = 7,
          .seed = seed,
          .has_sea = true};
}

// Heights of the ground, by rays.
class Heights {
 public:
  static absl::StatusOr<Heights> of(const WorldSettings& settings, const Ground& ground) {
    WorldBuilder builder(settings);
    builder.add("ground", builder.shape(ground), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
    absl::StatusOr<std::unique_ptr<PartitionCluster>> bare = PartitionCluster::create(builder.world(), 1);
    if (!bare.ok()) return bare.status();
    Heights heights;
    heights.bare_ = *std::move(bare);
    return heights;
  }

  // m, above sea level.
  double at(const Eigen::Vector3d& up) const {
    Partition& partition = bare_->partition(0);
    const double above = kSummits + 50;
    const absl::StatusOr<WorldPosition> from =
        canonical({}, up * (kGlobeRadius + above), partition.sector_size());
    const std::optional<RayAnswer> hit =
        from.ok() ? raycast(partition, *from, -up, 2 * above, ~0u) : std::nullopt;
    return hit ? above - hit->distance : 0;
  }

 private:
  std::unique_ptr<PartitionCluster> bare_;
};

// Where the pole is a little above the sea.
absl::StatusOr<std::pair<Ground, Heights>> ground_with_coast(const WorldSettings& settings) {
  for (std::uint64_t seed = 1;; ++seed) {
    const Ground ground = globe(seed);
    absl::StatusOr<Heights> heights = Heights::of(settings, ground);
    if (!heights.ok()) return heights.status();
    const double height = heights->at(Eigen::Vector3d::UnitZ());
    if (height > 1 && height < 8) return std::pair(ground, *std::move(heights));
  }
}

// At the pole, on its way along x.
void add_car(WorldBuilder& builder, double ground) {
  constexpr double kWheel = 0.4;   // m, radius
  constexpr double kTurns = 20;    // rad/s
  constexpr double kEffort = 250;  // N m
  const Eigen::Vector3d middle(0, 0, kGlobeRadius + ground + 1.5);
  const ShapeId chassis = builder.shape(Box{{3, 1.2, 0.4}});
  const ShapeId wheel = builder.shape(Cylinder{kWheel, 0.3});
  builder.add("car", chassis, 800, middle);
  for (const double x : {-1.1, 1.1}) {
    for (const double y : {-0.9, 0.9}) {
      const std::string name = absl::StrCat("wheel", x, y);
      const Eigen::Vector3d at = middle + Eigen::Vector3d(x, y, -0.3);
      BodyDescription& body = builder.add(name, wheel, 30, at);
      body.properties.friction = 1;
      body.pose.orientation =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY());
      JointDescription& axle = builder.tie(absl::StrCat("axle", x, y), JointType::kRevolute, "car", name, at,
                                           Eigen::Vector3d::UnitY());
      axle.properties.axes[0].effort_max = kEffort;
      axle.drives[0] = {DriveMode::kVelocity, kTurns};
    }
  }
}

struct Sample {
  double way = 0;     // m, so far
  double height = 0;  // m, above sea level
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};

class GroundMeasurement {
 public:
  GroundMeasurement(const ExperimentOptions& options, const Progress& progress)
      : options_(options),
        ticks_((options.quick ? 10 : 60) * kTicksPerSecond),
        boxes_(options.quick ? 100 : 1000),
        count_(progress, 4 * ticks_ / kTicksPerSecond, report_) {}

  absl::StatusOr<Report> measure() {
    WorldSettings settings;
    settings.precision = options_.precision;
    absl::StatusOr<WorldDescription> world = globe_world(settings, boxes_);
    if (!world.ok()) return world.status();
    for (const int partitions : {1, 4}) {
      if (absl::Status status = in_process(*world, partitions); !status.ok()) return status;
    }
    for (const int servers : {1, 4}) {
      if (absl::Status status = on_servers(*world, servers); !status.ok()) return status;
    }
    return std::move(report_);
  }

 private:
  absl::Status in_process(const WorldDescription& world, int partitions) {
    // What another run has left is not to help.
    TileStore& store = TileStore::of_process();
    store.set_options({.bytes_max = 0});
    store.set_options({});
    const std::size_t heap_before = heap_bytes();
    absl::StatusOr<std::unique_ptr<PartitionCluster>> made =
        PartitionCluster::create(world, static_cast<std::uint32_t>(partitions));
    if (!made.ok()) return made.status();
    PartitionCluster& cluster = **made;
    Tick waited = 0;
    double ms = 0;
    std::map<std::string, std::pair<Sample, Sample>> ways;  // from the first to the last
    for (Tick tick = 0; tick < ticks_; ++tick) {
      const std::uint64_t waits = store.counts().waits;
      const Stopwatch watch;
      cluster.step();
      ms += watch.microseconds() / 1000;
      if (tick >= kSettleTicks && store.counts().waits != waits) ++waited;
      if ((tick + 1) % kTicksPerSecond != 0) continue;
      if (partitions == 1) {
        note_memory(cluster, (tick + 1) / kTicksPerSecond, heap_before);
        if (absl::Status status = note_ways(world, cluster, ways); !status.ok()) return status;
      }
      if (absl::Status status = count_.advance(); !status.ok()) return status;
    }
    for (const auto& [body, way] : ways) {
      report_.table("ways").push_back({{"engine", name_of(options_.precision)},
                                       {"body", body},
                                       {"way_km", way.second.way / 1000},
                                       {"height_from", way.first.height},
                                       {"height_to", way.second.height}});
    }
    const TileStore::Counts tiles = store.counts();
    add_row(partitions == 1 ? "one process" : absl::StrCat(partitions, " partitions"), ms, waited,
            tiles.tiles, tiles.bytes, peak_bytes(), cluster.hash().to_string());
    return absl::OkStatus();
  }

  void note_memory(PartitionCluster& cluster, Tick second, std::size_t heap_before) {
    const TileStore::Counts tiles = TileStore::of_process().counts();
    const TickCounts counts = cluster.counts();
    report_.table("memory").push_back(
        {{"engine", name_of(options_.precision)},
         {"second", second},
         {"awake", counts.bodies_awake},
         {"sectors", counts.sectors},
         {"heap_mb", (static_cast<double>(heap_bytes()) - static_cast<double>(heap_before)) / kMegabyte},
         {"tiles", tiles.tiles},
         {"tile_mb", static_cast<double>(tiles.bytes) / kMegabyte}});
  }

  static absl::Status note_ways(const WorldDescription& world, const PartitionCluster& cluster,
                                std::map<std::string, std::pair<Sample, Sample>>& ways) {
    for (std::size_t place = 0; place < world.bodies.size(); ++place) {
      const std::string& name = world.bodies[place].name;
      if (name != "car" && name != "ball" && name != "aircraft") continue;
      const absl::StatusOr<BodyRecord> body = cluster.body(BodyId{place + 1});
      if (!body.ok()) return body.status();
      Sample now;
      now.at = relative_to({body->home, Eigen::Vector3d(body->state.position.data())}, {},
                           world.settings.sector_size);
      now.height = now.at.norm() - kGlobeRadius;
      const auto [way, is_first] = ways.try_emplace(name, now, now);
      if (is_first) continue;
      now.way = way->second.second.way + (now.at - way->second.second.at).norm();
      way->second.second = now;
    }
    return absl::OkStatus();
  }

  absl::Status on_servers(const WorldDescription& world, int servers) {
    absl::StatusOr<std::unique_ptr<experiments::LocalServers>> started =
        experiments::LocalServers::start(servers, options_.precision);
    if (!started.ok()) return started.status();
    Client& client = (*started)->client();
    if (auto loaded = client.load(world); !loaded.ok()) return loaded.status();
    std::uint64_t before = 0;  // ticks that waited in the first second
    double ms = 0;
    absl::StatusOr<ClusterStatus> status;
    for (Tick tick = 0; tick < ticks_; tick += kTicksPerSecond) {
      const Stopwatch watch;
      if (auto stepped = client.step(kTicksPerSecond); !stepped.ok()) return stepped.status();
      ms += watch.microseconds() / 1000;
      status = client.status();
      if (!status.ok()) return status.status();
      if (tick == 0) before = waited_of(*status);
      if (absl::Status going = count_.advance(); !going.ok()) return going;
    }
    std::uint64_t tiles = 0;
    std::uint64_t bytes = 0;
    std::uint64_t peak = 0;
    for (const ServerStatus& server : status->servers) {
      tiles = std::max(tiles, server.ground.tiles);
      bytes = std::max(bytes, server.ground.bytes);
      peak = std::max(peak, server.peak_rss_bytes);
    }
    const absl::StatusOr<HashAt> hash = client.hash();
    if (!hash.ok()) return hash.status();
    add_row(absl::StrCat(servers, servers == 1 ? " server" : " servers"), ms, waited_of(*status) - before,
            tiles, bytes, peak, hash->hash);
    return absl::OkStatus();
  }

  static std::uint64_t waited_of(const ClusterStatus& status) {
    std::uint64_t most = 0;
    for (const ServerStatus& server : status.servers) most = std::max(most, server.ground.ticks_waited);
    return most;
  }

  void add_row(const std::string& where, double ms, std::uint64_t waited, std::uint64_t tiles,
               std::uint64_t bytes, std::size_t peak, const std::string& hash) {
    if (hash_.empty()) hash_ = hash;
    if (hash != hash_) report_.misses.push_back(where + ": other bits than in one process");
    report_.table("rows").push_back({{"engine", name_of(options_.precision)},
                                     {"where", where},
                                     {"ticks", ticks_},
                                     {"boxes", boxes_},
                                     {"tick_ms", ms / static_cast<double>(ticks_)},
                                     {"ticks_waited", waited},
                                     {"tiles", tiles},
                                     {"tile_mb", static_cast<double>(bytes) / kMegabyte},
                                     {"process_mb", static_cast<double>(peak) / kMegabyte},
                                     {"same_bits", hash == hash_},
                                     {"hash", hash}});
  }

  const ExperimentOptions& options_;
  const Tick ticks_;
  const int boxes_;
  ProgressCount count_;
  std::string hash_;
  Report report_;
};

}  // namespace

absl::StatusOr<WorldDescription> globe_world(const WorldSettings& given, int boxes) {
  WorldSettings settings = given;
  settings.gravity = CentralGravity{.surface = 9.82, .radius = kGlobeRadius};
  absl::StatusOr<std::pair<Ground, Heights>> place = ground_with_coast(settings);
  if (!place.ok()) return place.status();
  const auto& [ground, heights] = *place;
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(ground), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  add_car(builder, heights.at(Eigen::Vector3d::UnitZ()));

  const double start = heights.at(Eigen::Vector3d::UnitX());
  BodyDescription& ball =
      builder.add("ball", builder.shape(Sphere{0.5}), 50, Eigen::Vector3d(kGlobeRadius + start + 20, 0, 0));
  ball.linear_velocity = {0, kGlobeSpeed, 0};
  ball.properties.friction = 0;

  BodyDescription& aircraft = builder.add("aircraft", builder.shape(Box{{12, 3, 2}}), 2000,
                                          Eigen::Vector3d(-kGlobeRadius - kSummits - 20, 0, 0));
  aircraft.linear_velocity = {0, kGlobeSpeed, 0};
  aircraft.properties.gravity = false;

  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  for (int n = 0; n < boxes; ++n) {
    const Eigen::Vector3d up = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    builder.add(absl::StrCat("box", n), box, 10, up * (kGlobeRadius + heights.at(up) + kDropHeight));
  }
  return builder.world();
}

absl::StatusOr<Report> measure_ground(const ExperimentOptions& options, const Progress& progress) {
  return GroundMeasurement(options, progress).measure();
}

}  // namespace tessera
