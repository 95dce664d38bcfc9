#include "experiments/motion/crossings.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "lpss/model/frame_motion.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

constexpr double kPassingSize = 0.3;   // m, of a body
constexpr double kPassingApart = 0.8;  // m, in the grid
constexpr double kThrough = 9;         // m/s, through the region
constexpr double kRegion = 30;         // m, its edge along the way; it is as wide as the grid
constexpr double kBefore = 4;          // m, of the first bodies from its middle plane, beyond its edge
constexpr double kPassingSector = 16;  // m

struct Passing {
  int bodies = 0;
  int pairs = 0;

  int rows() const { return bodies + 2 * pairs; }
};

// In a plane across their way, pairs after single bodies.
WorldDescription passing_and_frame(const ExperimentOptions& options, const Passing& passing, double speed,
                                   double spin) {
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sector_size = kPassingSector;
  settings.gravity = UniformGravity{Vector3d::Zero()};
  // An even number, as that of single bodies: both of a pair are in one row.
  const int columns = 2 * static_cast<int>(std::ceil(std::sqrt(passing.rows()) / 2));
  const double width = kPassingApart * columns;
  MovingFrame frame;
  frame.name = "through";
  frame.velocity = {speed, 0, 0};
  frame.spin = {0, spin, 0};
  // Whatever the frame turns by about y, all of the grid passes through.
  frame.region = FrameRegion{Vector3d::Zero(), {2 * width, kRegion, 2 * width}};
  settings.frames = {frame};
  WorldBuilder builder(settings);
  const ShapeId box = builder.shape(Box{{kPassingSize, kPassingSize, kPassingSize}});
  for (int n = 0; n < passing.rows(); ++n) {
    const int row = n / columns;
    const Vector3d place(kPassingApart * (n % columns) - width / 2, -kRegion / 2 - kBefore,
                         kPassingApart * row - width / 2);
    const std::string name = absl::StrCat("body", n);
    builder.add(name, box, 2, place).linear_velocity = {speed, kThrough, 0};
    if (n >= passing.bodies && (n - passing.bodies) % 2 == 1) {
      builder.tie(absl::StrCat("joint", n), JointType::kBall, absl::StrCat("body", n - 1), name,
                  place - Vector3d(kPassingApart / 2, 0, 0));
    }
  }
  return builder.world();
}

struct Seen {
  FrameNumber frame = kWorldFrame;
  FramedBody outside;
};

using Sight = absl::flat_hash_map<BodyId, Seen>;

Sight look(const Simulation& simulation) {
  const WorldSettings& settings = simulation.partition().settings;
  const FramePlace place =
      *frame_place(settings, 1, static_cast<double>(simulation.tick()) * settings.time_step);
  Sight sight;
  simulation.for_each_body([&](const BodyRecord& body) {
    const FramedBody here{body.home, body.state};
    const bool is_outside = body.home.frame == kWorldFrame;
    sight[body.id] = {body.home.frame, is_outside ? here : *out_of_frame(place, here, settings.sector_size)};
  });
  return sight;
}

struct Found {
  int crossings = 0;
  int parted = 0;
  double jump = 0;      // m
  double momentum = 0;  // of it
};

void compare(const Sight& before, const Sight& now, const WorldSettings& settings, Found& found) {
  for (const auto& [id, seen] : now) {
    const auto was = before.find(id);
    if (was == before.end() || was->second.frame == seen.frame) continue;
    ++found.crossings;
    const FramedBody& from = was->second.outside;
    const FramedBody& to = seen.outside;
    const Vector3d speed(from.state.linear_velocity.data());
    const Vector3d way = metres_between(from.home, to.home, settings.sector_size) +
                         Vector3d(to.state.position.data()) - Vector3d(from.state.position.data());
    found.jump = std::max(found.jump, (way - speed * settings.time_step).norm());
    const Vector3d change = Vector3d(to.state.linear_velocity.data()) - speed;
    found.momentum = std::max(found.momentum, change.norm() / speed.norm());
  }
}

int parted_pairs(const Sight& now, const Passing& passing) {
  int parted = 0;
  for (int pair = 0; pair < passing.pairs; ++pair) {
    const std::uint64_t first = static_cast<std::uint64_t>(passing.bodies + 2 * pair) + 1;
    const auto a = now.find(BodyId{first});
    const auto b = now.find(BodyId{first + 1});
    if (a != now.end() && b != now.end() && a->second.frame != b->second.frame) ++parted;
  }
  return parted;
}

}  // namespace

absl::StatusOr<Report> measure_crossings(const ExperimentOptions& options, double speed, double spin) {
  const Passing passing = options.quick ? Passing{120, 12} : Passing{1700, 170};
  const WorldDescription world = passing_and_frame(options, passing, speed, spin);
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
  if (!simulation.ok()) return simulation.status();
  const WorldSettings& settings = (*simulation)->partition().settings;
  const auto ticks = static_cast<int>((kRegion + 2 * kBefore) / kThrough / settings.time_step);
  Found found;
  std::vector<WorldHash> hashes;
  Sight before = look(**simulation);
  for (int tick = 0; tick < ticks; ++tick) {
    (*simulation)->step();
    hashes.push_back((*simulation)->hash());
    Sight now = look(**simulation);
    compare(before, now, settings, found);
    found.parted += parted_pairs(now, passing);
    before = std::move(now);
  }
  bool same = true;
  for (const std::uint32_t partitions : {2u, 4u}) {
    auto cluster = PartitionCluster::create(world, partitions, /*threads=*/1);
    if (!cluster.ok()) return cluster.status();
    for (const WorldHash& hash : hashes) {
      (*cluster)->step();
      same = same && (*cluster)->hash() == hash;
    }
  }
  const int lost = passing.rows() - static_cast<int>(before.size());
  Report report;
  report.table("crossings")
      .push_back({{"engine", name_of(options.precision)},
                  {"speed", speed},
                  {"spin", spin},
                  {"bodies", passing.bodies},
                  {"pairs", passing.pairs},
                  {"crossings", found.crossings},
                  {"lost", lost},
                  {"parted", found.parted},
                  {"jump", found.jump},
                  {"momentum", found.momentum},
                  {"same", same}});
  const std::string where = absl::StrCat(speed, " m/s, ", spin, " rad/s: ");
  if (found.crossings != 2 * passing.rows() || lost != 0 || found.parted != 0) {
    report.misses.push_back(absl::StrCat(where, found.crossings, " of ", 2 * passing.rows(), " crossings, ",
                                         lost, " bodies lost, ", found.parted, " pairs in two frames"));
  }
  if (!same) report.misses.push_back(absl::StrCat(where, "another hash in two or four partitions"));
  return report;
}

}  // namespace tessera
