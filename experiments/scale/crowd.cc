#include "experiments/scale/crowd.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "lpss/simulation/example_worlds.h"
#include "simulator/simulated_cluster.h"

namespace tessera {
namespace {

constexpr std::uint32_t kServers = 4;
constexpr int kEdge = 10;         // sectors, of the plain
constexpr int kRoadLength = 100;  // sectors
constexpr int kRoadWidth = 6;     // sectors
constexpr double kSectorEdge = 5;
constexpr double kTimeStep = 1.0 / 60;
constexpr double kRadius = 0.15;    // m, of a ball
constexpr double kNextBall = 0.33;  // m, from ball to ball
constexpr double kSpeed = 3;        // m/s
constexpr double kPost = 0.3;       // m, edge of a box that stands in a sector
constexpr double kWalk = 0.8;       // m/s
constexpr double kDrag = 0.4;       // part of its speed and spin that a walking ball loses in a second

// Of all servers, tick by tick.
class Work {
 public:
  void hear(NodeId server, const v1::Report& report) {
    moved_bytes_[server] = report.moved_bytes();
    exchange_bytes_[server] = report.exchange_bytes();
    for (const v1::TickReport& tick : report.ticks()) {
      OfTick& one = ticks_[tick.tick()];
      ++one.servers;
      one.sum_us += static_cast<double>(tick.own_us());
      one.largest_us = std::max(one.largest_us, static_cast<double>(tick.own_us()));
      one.duration_us = std::max(one.duration_us, static_cast<double>(tick.work_us()));
      if (one.servers == kServers) complete_ = std::max<Tick>(complete_, tick.tick());
    }
  }

  // The last tick of which all have reported.
  Tick complete() const { return complete_; }

  // Of the ticks up to `last`.
  CrowdRun summary(Tick last) const {
    CrowdRun run;
    std::vector<double> largest;
    double sum_us = 0;
    for (const auto& [tick, one] : ticks_) {
      if (tick > last) break;
      sum_us += one.sum_us;
      largest.push_back(one.largest_us / 1000);
      run.largest_ms += one.largest_us / 1000;
      run.late += one.duration_us > kTimeStep / kCrowdPace * 1e6 ? 1 : 0;
    }
    if (largest.empty()) return run;
    const auto ticks = static_cast<double>(largest.size());
    run.largest_ms /= ticks;
    run.mean_ms = sum_us / 1000 / kServers / ticks;
    const auto p99 = largest.begin() + static_cast<std::ptrdiff_t>(0.99 * (ticks - 1));
    std::nth_element(largest.begin(), p99, largest.end());
    run.largest_p99_ms = *p99;
    double bytes = 0;
    for (const auto& [server, moved] : moved_bytes_) run.moved_kb += static_cast<double>(moved) / 1000;
    for (const auto& [server, exchanged] : exchange_bytes_) bytes += static_cast<double>(exchanged);
    run.exchanged_kb = (bytes / 1000 - run.moved_kb) / static_cast<double>(complete_);
    return run;
  }

 private:
  struct OfTick {
    std::uint32_t servers = 0;  // that have reported it
    double sum_us = 0;
    double largest_us = 0;
    double duration_us = 0;
  };

  std::map<Tick, OfTick> ticks_;
  std::map<NodeId, std::uint64_t> moved_bytes_;
  std::map<NodeId, std::uint64_t> exchange_bytes_;
  Tick complete_ = 0;
};

WorldSettings settings_of(const CrowdOptions& options) {
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sector_size = kSectorEdge;
  settings.time_step = kTimeStep;
  return settings;
}

// A floor, and a box in each of so many sectors.
void add_ground(WorldBuilder& builder, int along_x, int along_y) {
  builder.add_floor(4 * std::max(along_x, along_y) * kSectorEdge, 0);
  const ShapeId post = builder.shape(Box{{kPost, kPost, kPost}});
  for (int i = 0; i < along_x; ++i) {
    for (int j = 0; j < along_y; ++j) {
      const Eigen::Vector3d corner((i + 0.45) * kSectorEdge, (j + 0.45) * kSectorEdge, kPost / 2);
      builder.add(absl::StrCat("post_", i, "_", j), post, 1000, corner);
    }
  }
}

// They roll.
void add_balls(WorldBuilder& builder, int balls, const Eigen::Vector3d& velocity, double damping = 0) {
  const ShapeId ball = builder.shape(Sphere{kRadius});
  const int row = static_cast<int>(std::ceil(std::sqrt(balls)));
  for (int n = 0; n < balls; ++n) {
    // A little out of line, so that they meet.
    const int column = n % row;
    const int line = n / row;
    const Eigen::Vector3d place(column * kNextBall + 0.01 * (n * 7 % 5),
                                line * kNextBall + 0.01 * (n * 3 % 7), kRadius);
    BodyDescription& body = builder.add(absl::StrCat("ball_", n), ball, 1, place);
    body.linear_velocity = velocity;
    body.angular_velocity = Eigen::Vector3d::UnitZ().cross(velocity) / kRadius;
    body.properties.linear_damping = body.properties.angular_damping = damping;
  }
}

Nanoseconds nanoseconds(double seconds) { return Nanoseconds(static_cast<std::int64_t>(seconds * 1e9)); }

}  // namespace

WorldDescription crowd_world(const CrowdOptions& options) {
  WorldBuilder builder(settings_of(options));
  add_ground(builder, kEdge, kEdge);
  const double way = kSpeed / std::sqrt(2.0);
  add_balls(builder, options.bodies, {way, way, 0});
  return std::move(builder.world());
}

WorldDescription walk_world(const CrowdOptions& options) {
  WorldSettings settings = settings_of(options);
  // A ball that rolls has seven fifths of its mass to accelerate, and to brake.
  UniformGravity slope;
  slope.acceleration.x() = 1.4 * -std::log(1 - kDrag) * kWalk;
  settings.gravity = slope;
  WorldBuilder builder(settings);
  add_ground(builder, kRoadLength, kRoadWidth);
  add_balls(builder, options.bodies, {kWalk, 0, 0}, kDrag);
  return std::move(builder.world());
}

absl::StatusOr<CrowdRun> run_crowd(const WorldDescription& world, Tick ticks, const Sharing& sharing,
                                   const std::function<bool()>& go_on) {
  constexpr std::uint64_t kEventsAtOnce = 200;
  // The servers are up to a window of grants ahead when the world pauses.
  constexpr Tick kAhead = 64;
  Work work;
  SimulatedClusterOptions options;
  options.network = {.delay_ns_min = 50'000, .delay_ns_max = 100'000};
  options.checkpoint_every = std::chrono::hours(1);
  options.balance_every = nanoseconds(sharing.every);
  options.balance_ahead = nanoseconds(sharing.ahead);
  options.balance_policy = sharing.policy;
  options.takes_time = true;
  options.reports = [&work](NodeId server, const v1::Report& report) { work.hear(server, report); };
  SimulatedCluster cluster(1, kServers, world.settings.precision, options);
  cluster.end_when([&go_on] { return !go_on(); });
  if (absl::Status loaded = cluster.load(world); !loaded.ok()) return loaded;
  const absl::StatusOr<v1::StatusReply> before = cluster.status();
  if (!before.ok()) return before.status();

  v1::ResumeRequest resume;
  resume.set_real_time_factor(kCrowdPace);
  const auto resumed = cluster.call<v1::ResumeRequest, v1::ResumeReply>(resume);
  if (!resumed.ok()) return resumed.status();
  const std::uint64_t began_ns = cluster.network().now_ns();
  while (work.complete() < ticks) {
    if (!go_on()) return absl::CancelledError("interrupted");
    if (!cluster.failure().ok()) return cluster.failure();
    cluster.run_events(kEventsAtOnce);
  }
  const double took = static_cast<double>(cluster.network().now_ns() - began_ns) / 1e9;
  const double done = static_cast<double>(work.complete()) * kTimeStep;
  const auto paused = cluster.call<v1::PauseRequest, v1::PauseReply>({});
  if (!paused.ok()) return paused.status();
  const absl::StatusOr<v1::StatusReply> after = cluster.status();
  if (!after.ok()) return after.status();
  CrowdRun run = work.summary(ticks);
  const Tick end = std::max<Tick>(ticks + kAhead, paused->tick());
  if (end > paused->tick()) {
    if (absl::Status stepped = cluster.step(end - paused->tick()); !stepped.ok()) return stepped;
  }
  const absl::StatusOr<SimulatedCluster::HashAt> hash = cluster.hash();
  if (!hash.ok()) return hash.status();
  run.hash = absl::StrCat(hash->tick, ":", hash->hash);
  run.real_time_factor = done / took;
  run.moves = after->map_epoch() - before->map_epoch();
  run.moved_sectors = after->moved_sectors();
  run.moved_bodies = after->moved_bodies();
  return run;
}

}  // namespace tessera
