#include "sector_server/body_snapshot.h"

#include <algorithm>

#include "lpss/model/world_records.h"
#include "proto/body_columns.h"
#include "proto/convert.h"

namespace tessera {
namespace {

void describe(const BodySnapshot::Body& body, double sector_size, v1::BodyState& state) {
  state.set_id(body.id.value);
  *state.mutable_pose() = to_proto(body_pose(body.home, body.state, body.centre_frame, sector_size));
  *state.mutable_linear_velocity() = to_proto(Eigen::Vector3d(body.state.linear_velocity.data()));
  *state.mutable_angular_velocity() = to_proto(Eigen::Vector3d(body.state.angular_velocity.data()));
  state.set_asleep(body.state.activity == Activity::kAsleep);
}

BodyRow row_of(const BodySnapshot::Body& body, double sector_size) {
  const BodyState& state = body.state;
  return {body.id, body_pose(body.home, state, body.centre_frame, sector_size),
          Eigen::Vector3d(state.linear_velocity.data()), Eigen::Vector3d(state.angular_velocity.data()),
          state.activity == Activity::kAsleep};
}

using BodiesInOrder = std::vector<const BodySnapshot::Body*>;

BodiesInOrder by_id(const BodySnapshot& snapshot) {
  BodiesInOrder bodies;
  bodies.reserve(snapshot.bodies.size());
  for (const BodySnapshot::Body& body : snapshot.bodies) bodies.push_back(&body);
  std::sort(bodies.begin(), bodies.end(), [](const auto* a, const auto* b) { return a->id < b->id; });
  return bodies;
}

void describe(const BodiesInOrder& bodies, double sector_size, v1::BodyColumns& columns) {
  ColumnWriter writer(columns);
  writer.reserve(static_cast<int>(bodies.size()));
  for (const BodySnapshot::Body* body : bodies) writer.add(row_of(*body, sector_size));
}

void pack(const BodiesInOrder& bodies, double sector_size, BodyPacker& packer, v1::BodyBatch& batch) {
  packer.begin();
  for (const BodySnapshot::Body* body : bodies)
    packer.add(row_of(*body, sector_size), *batch.mutable_packed());
}

}  // namespace

std::size_t bytes_of(const BodySnapshot& snapshot) {
  return sizeof snapshot + snapshot.bodies.capacity() * sizeof(BodySnapshot::Body) +
         snapshot.gone.capacity() * sizeof(BodyId);
}

absl::StatusOr<std::optional<PackedPrecision>> precision_of(const v1::WatchBodiesRequest& request) {
  if (request.precision() == 0 && request.velocity_precision() == 0) return std::nullopt;
  const PackedPrecision precision{request.precision(), request.velocity_precision()};
  if (absl::Status status = check(precision); !status.ok()) return status;
  return precision;
}

BodyBatches::BodyBatches(const v1::WatchBodiesRequest& request) : in_columns_(request.in_columns()) {
  const auto precision = precision_of(request);
  if (precision.ok() && *precision) packer_.emplace(**precision);
}

void BodyBatches::write(const BodySnapshot& snapshot, NodeId node, v1::BodyBatch& batch) {
  batch.Clear();
  batch.set_tick(snapshot.tick);
  batch.set_node(node.value);
  *batch.mutable_source() = snapshot.source;
  batch.set_whole(snapshot.whole);
  batch.set_deferred(snapshot.deferred);
  for (const BodyId id : snapshot.gone) batch.add_gone(id.value);
  const BodiesInOrder bodies = by_id(snapshot);
  if (packer_) {
    if (snapshot.whole) packer_->clear();
    for (const BodyId id : snapshot.gone) packer_->forget(id);
    pack(bodies, snapshot.sector_size, *packer_, batch);
  } else if (in_columns_) {
    if (!bodies.empty()) describe(bodies, snapshot.sector_size, *batch.mutable_columns());
  } else {
    for (const auto* body : bodies) describe(*body, snapshot.sector_size, *batch.add_bodies());
  }
}

}  // namespace tessera
