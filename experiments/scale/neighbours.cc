#include "experiments/scale/neighbours.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "experiments/heap.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"
#include "proto/wire.h"

namespace tessera {
namespace {

constexpr double kBlockSector = 16;
constexpr double kBlockBox = 1;     // m
constexpr double kBlockFloor = -1;  // m, its height above the middle of sectors
constexpr double kOverlap = 1e-3;

// The least power of two by which a square, or one twice as long, has room for all.
int sectors_along(Layout layout, int servers, int axis) {
  const int sectors = servers * kSectorsPerServer;
  if (layout != Layout::kPlane) return axis == 0 ? sectors : 1;
  int edges[2] = {1, 1};
  for (int n = 0; edges[0] * edges[1] < sectors; n = 1 - n) edges[n] *= 2;
  return edges[axis];
}

constexpr std::uint64_t kBoxesOfRow = 4;  // of a sector

// The towers of a row, and the boxes across its borders, which are the third and the fourth of their sectors.
void add_joints(WorldDescription& world) {
  constexpr double kLever = (kBlockBox - kOverlap) / 2;
  const auto tie = [&](std::uint64_t parent, std::uint64_t child, const Eigen::Vector3d& lever) {
    JointDescription& joint = world.joints.emplace_back();
    joint.name = absl::StrCat("joint", world.joints.size());
    joint.properties.parent = BodyId{parent + 1};
    joint.properties.child = BodyId{child + 1};
    joint.properties.in_parent.position = lever;
    joint.properties.in_child.position = -lever;
  };
  const std::uint64_t first = world.bodies.size() % kBoxesOfRow;  // after the floor
  for (std::uint64_t box = first; box < world.bodies.size(); box += kBoxesOfRow) {
    tie(box, box + 1, kLever * Eigen::Vector3d::UnitZ());
    if (box + kBoxesOfRow < world.bodies.size())
      tie(box + 2, box + kBoxesOfRow + 3, kLever * Eigen::Vector3d::UnitX());
  }
}

struct Traffic {
  std::vector<double> messages;
  std::vector<double> bytes;
  std::vector<absl::flat_hash_set<Rank>> peers;
  TrafficByRound by_round{};
};

PerServer summary(const std::vector<double>& all, double ticks) {
  PerServer result;
  for (const double one : all) {
    result.mean += one / ticks / static_cast<double>(all.size());
    result.largest = std::max(result.largest, one / ticks);
  }
  return result;
}

}  // namespace

WorldDescription neighbours_world(Layout layout, int servers, Precision precision) {
  WorldSettings settings;
  settings.precision = precision;
  settings.sector_size = kBlockSector;
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  const int along_x = sectors_along(layout, servers, 0);
  const int along_y = sectors_along(layout, servers, 1);
  builder.add_floor((std::max(along_x, along_y) + 1) * kBlockSector, kBlockFloor);
  const ShapeId box = builder.shape(Box{{kBlockBox, kBlockBox, kBlockBox}});
  int count = 0;
  const auto add = [&](double x, double y, double z) {
    builder.add(absl::StrCat("box", count++), box, 1, {x, y, kBlockFloor + kBlockBox / 2 + z - kOverlap});
  };
  constexpr double kNear = kBlockSector / 2 - kBlockBox / 2 + kOverlap / 2;
  constexpr double kInside = 4;  // away from the rim of the world
  for (int i = 0; i < along_x; ++i) {
    for (int j = 0; j < along_y; ++j) {
      const double x = i * kBlockSector;
      const double y = j * kBlockSector;
      add(x, y, 0);
      add(x, y, kBlockBox - kOverlap);
      add(x + (i + 1 < along_x ? kNear : kInside), y, 0);
      add(x - (i > 0 ? kNear : kInside), y, 0);
      if (layout != Layout::kPlane) continue;
      add(x + 2, y + (j + 1 < along_y ? kNear : kInside), 0);
      add(x + 2, y - (j > 0 ? kNear : kInside), 0);
    }
  }
  if (layout == Layout::kJointedRow) add_joints(builder.world());
  return std::move(builder.world());
}

absl::StatusOr<NeighboursRun> run_neighbours(const WorldDescription& world, std::uint32_t servers,
                                             std::uint32_t all_linked_max, Tick ticks,
                                             const std::function<bool()>& go_on) {
  NeighboursRun run;
  const auto step = [&](PartitionCluster& cluster) {
    if (!go_on()) return false;
    cluster.step();
    return true;
  };
  {
    auto one = PartitionCluster::create(world, 1);
    if (!one.ok()) return one.status();
    for (Tick tick = 0; tick < ticks; ++tick) {
      if (!step(**one)) return absl::CancelledError("interrupted");
    }
    run.hash_of_one = (*one)->hash().to_string();
  }
  const std::size_t heap_before = heap_bytes();
  auto cluster = PartitionCluster::create(world, servers);
  if (!cluster.ok()) return cluster.status();
  for (Rank rank = 0; rank < servers; ++rank) (*cluster)->partition(rank).all_linked_max = all_linked_max;
  Traffic traffic{std::vector<double>(servers), std::vector<double>(servers),
                  std::vector<absl::flat_hash_set<Rank>>(servers)};
  const Tick counted = ticks / 2;
  for (Tick tick = 0; tick < ticks; ++tick) {
    if (tick == ticks - counted) {
      (*cluster)->listen([&traffic](Rank from, Rank to, const RoundMessage& message) {
        const std::size_t size = pack(message).size();
        traffic.by_round[message.index()].add(size);
        for (const auto& [one, other] : {std::pair(from, to), std::pair(to, from)}) {
          ++traffic.messages[one];
          traffic.bytes[one] += static_cast<double>(size);
          traffic.peers[one].insert(other);
        }
      });
    }
    if (!step(**cluster)) return absl::CancelledError("interrupted");
  }
  const auto of_ticks = static_cast<double>(counted);
  std::vector<double> joints;
  for (Rank rank = 0; rank < servers; ++rank)
    joints.push_back(static_cast<double>((*cluster)->partition(rank).joints.size()));
  run.joints = summary(joints, 1);
  run.heap_kb = static_cast<double>(heap_bytes() - heap_before) / 1000 / servers;
  run.messages = summary(traffic.messages, of_ticks);
  run.bytes = summary(traffic.bytes, of_ticks);
  std::vector<double> peers;
  for (const auto& some : traffic.peers) peers.push_back(static_cast<double>(some.size()));
  run.peers = summary(peers, 1);
  for (std::size_t n = 0; n < kRoundNames.size(); ++n) {
    run.messages_by_round[n] = static_cast<double>(traffic.by_round[n].messages) / of_ticks / servers;
    run.bytes_by_round[n] = static_cast<double>(traffic.by_round[n].bytes) / of_ticks / servers;
  }
  run.hash = (*cluster)->hash().to_string();
  return run;
}

}  // namespace tessera
