#include "coordinator/placement.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "coordinator/balance.h"
#include "coordinator/limits.h"
#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/tick/recipients.h"
#include "proto/convert.h"
#include "proto/wire.h"

namespace tessera {
namespace {

using SectorLoad = std::vector<std::pair<SectorIndex, double>>;

SectorLoad load_of(std::span<const BodyRecord> records) {
  absl::flat_hash_map<SectorIndex, double> weights;
  for (const BodyRecord& record : records) {
    if (record.properties.motion != Motion::kStatic) weights.try_emplace(record.home, 1).first->second += 1;
  }
  return {weights.begin(), weights.end()};
}

// The radius of the largest movable body, which no server can compute alone.
double largest_radius(const WorldDescription& world, std::span<const BodyRecord> records) {
  double largest = 0;
  for (const BodyRecord& record : records) {
    if (record.properties.motion == Motion::kStatic) continue;
    const Eigen::Vector3d centre(record.properties.centre.data());
    largest = std::max(largest, bounding_radius(world.shapes[record.properties.shape], centre));
  }
  return largest;
}

// Static bodies go to all servers, others to their hosts, in order of id.
std::vector<std::string> records_by_rank(std::span<const BodyRecord> records, const SectorMap& map) {
  std::vector<std::vector<BodyRecord>> parts(map.servers());
  for (const BodyRecord& record : records) {
    if (record.properties.motion == Motion::kStatic) {
      for (std::vector<BodyRecord>& part : parts) part.push_back(record);
    } else {
      parts[map.owner(record.home)].push_back(record);
    }
  }
  std::vector<std::string> packed;
  for (std::vector<BodyRecord>& part : parts) {
    packed.push_back(pack(std::span<const BodyRecord>(part)));
    part = {};
  }
  return packed;
}

// Joints go to the hosts of their bodies, and to those of the children of joints that are coupled with them;
// to all servers where these know all of them.
std::vector<std::string> joints_by_rank(const WorldToLoad::Described& described, const SectorMap& map) {
  absl::flat_hash_map<BodyId, Rank> hosts;
  for (const BodyRecord& record : described.records) {
    if (record.properties.motion != Motion::kStatic) hosts.emplace(record.id, map.owner(record.home));
  }
  const std::vector<JointRecord>& joints = described.joints;
  const auto host_of_child = [&](JointId id) { return hosts.at(joints[id.value - 1].properties.child); };
  std::vector<Ranks> told(joints.size());
  for (std::size_t n = 0; n < joints.size(); ++n) {
    const JointProperties& joint = joints[n].properties;
    for (const BodyId body : {joint.parent, joint.child}) {
      if (const auto host = hosts.find(body); host != hosts.end()) told[n].insert(host->second);
    }
    for (const JointAxis& axis : axes_of(joint)) {
      if (!axis.mimic.is_set()) continue;
      told[n].insert(host_of_child(axis.mimic.leader));
      told[axis.mimic.leader.value - 1].insert(host_of_child(joints[n].id));
    }
    if (all_know_joints(described.world.settings)) told[n] = everyone(map);
  }
  std::vector<std::vector<JointRecord>> parts(map.servers());
  for (std::size_t n = 0; n < joints.size(); ++n)
    told[n].for_each([&](Rank rank) { parts[rank].push_back(joints[n]); });
  std::vector<std::string> packed;
  for (const std::vector<JointRecord>& part : parts)
    packed.push_back(pack(std::span<const JointRecord>(part)));
  return packed;
}

// The shapes of the world at its tick: those of held commands come with their grants.
void add_shapes(std::span<const Shape> shapes, v1::LoadWorld& load) {
  for (std::size_t id = 0; id < shapes.size(); ++id) {
    v1::NumberedShape& to = *load.add_shapes();
    to.set_id(id);
    *to.mutable_shape() = to_proto(shapes[id]);
  }
}
void add_shapes(std::span<const ShapeEntry> shapes, v1::LoadWorld& load) {
  for (const ShapeEntry& entry : shapes) *load.add_shapes() = to_proto(entry);
}

// What all servers are sent.
template <typename Shapes>
v1::LoadWorld common_load(std::uint64_t number, const WorldSettings& settings, const SectorIndex& anchor,
                          const Shapes& shapes, std::span<const NodeId> nodes, const SectorMap& map) {
  v1::LoadWorld common;
  common.set_world(number);
  *common.mutable_settings() = to_proto(settings);
  *common.mutable_anchor() = to_proto(anchor);
  add_shapes(shapes, common);
  for (const NodeId node : nodes) common.add_nodes(node.value);
  for (const SectorIndex& splitter : map.splitters()) *common.add_splitters() = to_proto(splitter);
  common.mutable_owners()->Add(map.owners().begin(), map.owners().end());
  common.set_map_epoch(map.epoch());
  return common;
}

// Divides sectors with so much to do.
template <typename Shapes>
Placement divided(std::uint64_t number, std::uint64_t map_epoch, const WorldSettings& settings,
                  const SectorIndex& anchor, const Shapes& shapes, const SectorLoad& load,
                  std::span<const Host> hosts, BalancePolicy policy) {
  Placement placement;
  placement.sectors = load.size();
  std::vector<NodeId> nodes;
  std::vector<double> capacities;
  for (const Host& host : hosts) {
    nodes.push_back(host.node);
    capacities.push_back(host.capacity);
  }
  invariant(!hosts.empty(), "a world is divided among servers");
  placement.map = first_map(anchor, load, capacities, map_epoch, policy);
  invariant(placement.map.servers() == hosts.size(), "every server has a rank");
  placement.loads.assign(hosts.size(), common_load(number, settings, anchor, shapes, nodes, placement.map));
  return placement;
}

absl::Status room_for(std::size_t bytes) {
  if (bytes <= kLoadMessageBytesMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("one server's part of the world has ", bytes,
                                                   " bytes, and may have at most ", kLoadMessageBytesMax));
}

absl::StatusOr<Placement> place(std::uint64_t number, std::uint64_t map_epoch, const WorldToLoad& world,
                                const WorldToLoad::Described& described, std::span<const Host> hosts,
                                BalancePolicy policy) {
  Placement placement = divided(number, map_epoch, world.settings(), world.anchor(), described.world.shapes,
                                load_of(described.records), hosts, policy);
  const double radius = largest_radius(described.world, described.records);
  std::vector<std::string> joints = joints_by_rank(described, placement.map);
  std::vector<std::string> records = records_by_rank(described.records, placement.map);
  for (std::size_t rank = 0; rank < hosts.size(); ++rank) {
    v1::LoadWorld& load = placement.loads[rank];
    absl::Status status = room_for(load.ByteSizeLong() + joints[rank].size() + records[rank].size());
    if (!status.ok()) return status;
    load.set_radius_max(radius);
    load.set_joints(std::move(joints[rank]));
    load.set_records(std::move(records[rank]));
  }
  return placement;
}

absl::StatusOr<Placement> place(std::uint64_t number, std::uint64_t map_epoch, const WorldToLoad& world,
                                const ReadSnapshot& snapshot, std::span<const Host> hosts,
                                BalancePolicy policy) {
  Placement placement = divided(number, map_epoch, world.settings(), world.anchor(), snapshot.world.shapes,
                                load_of(snapshot.world), hosts, policy);
  std::vector<std::vector<MovedSector>> sectors(hosts.size());
  for (const MovedSector& sector : snapshot.world.sectors) {
    sectors[placement.map.owner(sector.sector)].push_back(sector);
  }
  const std::string shared = pack(snapshot.world.shared);
  for (std::size_t rank = 0; rank < hosts.size(); ++rank) {
    v1::LoadWorld& load = placement.loads[rank];
    std::string packed = pack(std::span<const MovedSector>(sectors[rank]));
    sectors[rank] = {};
    absl::Status status = room_for(load.ByteSizeLong() + shared.size() + packed.size());
    if (!status.ok()) return status;
    v1::Restored& restored = *load.mutable_restored();
    restored.set_tick(snapshot.world.tick);
    restored.set_shared(shared);
    *restored.add_sectors() = std::move(packed);
  }
  return placement;
}

v1::LoadWorld guest_load(std::uint64_t number, const WorldToLoad& world,
                         const WorldToLoad::Described& described, std::span<const NodeId> nodes,
                         const SectorMap& map) {
  std::vector<BodyRecord> statics;
  for (const BodyRecord& record : described.records) {
    if (record.properties.motion == Motion::kStatic) statics.push_back(record);
  }
  v1::LoadWorld load =
      common_load(number, world.settings(), world.anchor(), described.world.shapes, nodes, map);
  load.set_radius_max(largest_radius(described.world, described.records));
  const std::span<const JointRecord> joints =
      all_know_joints(world.settings()) ? std::span(described.joints) : std::span<const JointRecord>();
  load.set_joints(pack(joints));
  load.set_records(pack(std::span<const BodyRecord>(statics)));
  return load;
}

v1::LoadWorld guest_load(std::uint64_t number, const WorldToLoad& world, const ReadSnapshot& snapshot,
                         std::span<const NodeId> nodes, const SectorMap& map) {
  v1::LoadWorld load =
      common_load(number, world.settings(), world.anchor(), snapshot.world.shapes, nodes, map);
  load.mutable_restored()->set_tick(snapshot.world.tick);
  load.mutable_restored()->set_shared(pack(snapshot.world.shared));
  return load;
}

}  // namespace

absl::StatusOr<Placement> place(std::uint64_t number, const WorldToLoad& world, std::span<const Host> hosts,
                                std::uint64_t map_epoch, BalancePolicy policy) {
  return std::visit([&](const auto& from) { return place(number, map_epoch, world, from, hosts, policy); },
                    world.from);
}

absl::StatusOr<Placement> place(std::uint64_t number, const KeptState& world, std::span<const Host> hosts,
                                std::uint64_t map_epoch, BalancePolicy policy) {
  SectorLoad load;
  std::vector<std::pair<SectorIndex, const std::string*>> sectors;
  for (const auto& [key, chunk] : world.chunks) {
    if (chunk->has_shared()) continue;
    const std::optional<SectorIndex> index = sector_of_key(key);
    const absl::StatusOr<std::vector<MovedSector>> read = unpack_sectors(chunk->sectors());
    if (!read.ok()) return read.status();
    if (!index || read->size() != 1 || read->front().sector != *index)
      return absl::DataLossError("a chunk of a checkpoint is not under the key of its sector");
    sectors.emplace_back(*index, &chunk->sectors());
    const std::size_t bodies = read->front().bodies.size();
    if (bodies > 0) load.emplace_back(*index, 1 + static_cast<double>(bodies));
  }
  Placement placement =
      divided(number, map_epoch, world.settings, world.anchor, world.shapes, load, hosts, policy);
  const std::string shared = shared_bytes(world.chunks);
  for (v1::LoadWorld& to : placement.loads) {
    to.mutable_restored()->set_tick(world.tick);
    to.mutable_restored()->set_shared(shared);
  }
  for (const auto& [index, bytes] : sectors)
    placement.loads[placement.map.owner(index)].mutable_restored()->add_sectors(*bytes);
  for (const v1::LoadWorld& to : placement.loads) {
    if (absl::Status status = room_for(to.ByteSizeLong()); !status.ok()) return status;
  }
  return placement;
}

v1::LoadWorld guest_load(std::uint64_t number, const WorldToLoad& world, std::span<const NodeId> nodes,
                         const SectorMap& map) {
  return std::visit([&](const auto& from) { return guest_load(number, world, from, nodes, map); },
                    world.from);
}

v1::LoadWorld guest_load(std::uint64_t number, const KeptState& world, std::span<const NodeId> nodes,
                         const SectorMap& map) {
  v1::LoadWorld load = common_load(number, world.settings, world.anchor, world.shapes, nodes, map);
  load.mutable_restored()->set_tick(world.tick);
  load.mutable_restored()->set_shared(shared_bytes(world.chunks));
  return load;
}

}  // namespace tessera
