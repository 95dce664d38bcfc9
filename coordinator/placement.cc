#include "coordinator/placement.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/limits.h"
#include "proto/convert.h"
#include "proto/wire.h"

namespace tessera {
namespace {

std::vector<std::pair<SectorIndex, double>> load_of(std::span<const BodyRecord> records) {
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

}  // namespace

absl::StatusOr<Placement> place(std::uint64_t number, const WorldDescription& world,
                                std::span<const BodyRecord> records, std::span<const JointRecord> joints,
                                std::span<const NodeId> nodes) {
  Placement placement;
  std::vector<std::pair<SectorIndex, double>> load = load_of(records);
  placement.sectors = load.size();
  placement.map = SectorMap::balanced(world.anchor, std::move(load), static_cast<std::uint32_t>(nodes.size()),
                                      /*epoch=*/1);

  v1::LoadWorld common;
  common.set_world(number);
  *common.mutable_settings() = to_proto(world.settings);
  *common.mutable_anchor() = to_proto(world.anchor);
  for (const Shape& shape : world.shapes) *common.add_shapes() = to_proto(shape);
  for (const NodeId node : nodes) common.add_nodes(node.value);
  for (const SectorIndex& splitter : placement.map.splitters()) *common.add_splitters() = to_proto(splitter);
  common.set_map_epoch(placement.map.epoch());
  common.set_radius_max(largest_radius(world, records));
  common.set_joints(pack(joints));

  const std::size_t common_bytes = common.ByteSizeLong();
  for (std::string& packed : records_by_rank(records, placement.map)) {
    if (common_bytes + packed.size() > kLoadMessageBytesMax) {
      return absl::ResourceExhaustedError(
          absl::StrCat("one server's part of the world has ", common_bytes + packed.size(),
                       " bytes, and may have at most ", kLoadMessageBytesMax));
    }
    v1::LoadWorld& part = placement.loads.emplace_back(common);
    part.set_records(std::move(packed));
  }
  return placement;
}

}  // namespace tessera
