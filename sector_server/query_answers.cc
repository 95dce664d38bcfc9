#include "sector_server/query_answers.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/model/validate.h"
#include "lpss/observe/load.h"
#include "lpss/observe/queries.h"
#include "lpss/observe/state.h"
#include "proto/convert.h"
#include "proto/snapshot.h"
#include "proto/wire.h"

namespace tessera {
namespace {

// Sectors, how far from a probe bodies are searched for: as far as the coordinator allows.
constexpr double kNearReachMax = 4;
constexpr double kUnitTolerance = 1e-6;

absl::StatusOr<Shape> probe_of(const v1::NearQuery& query) {
  v1::Shape probe;
  *probe.add_parts()->mutable_geometry() = query.probe();
  absl::StatusOr<Shape> shape = from_proto(probe);
  if (!shape.ok()) return shape.status();
  if (absl::Status status = validate(*shape, "probe"); !status.ok()) return status;
  return shape;
}

void write_hash(const Partition& partition, v1::Answer& answer) {
  const WorldHash hash = hash_of(partition);
  answer.set_hash_low(hash.low());
  answer.set_hash_high(hash.high());
}

void write_hit(Partition& partition, const v1::RayQuery& ray, v1::Answer& answer) {
  const std::optional<RayAnswer> hit =
      raycast(partition, from_proto(ray.origin()), from_proto(ray.direction()), ray.length(), ray.mask());
  answer.set_hit(hit.has_value());
  if (!hit) return;
  answer.set_body(hit->body.value);
  answer.set_distance(hit->distance);
  *answer.mutable_normal() = to_proto(hit->normal);
}

void write_near(Partition& partition, const v1::NearQuery& query, v1::Answer& answer) {
  const absl::StatusOr<Shape> shape = probe_of(query);
  invariant(shape.ok(), "queries are checked as they come");
  for (const NearBody& near : bodies_near(partition, shape->parts.front().geometry, from_proto(query.pose()),
                                          query.reach(), query.mask())) {
    v1::NearBody& body = *answer.add_near();
    body.set_body(near.body.value);
    body.set_distance(near.distance);
  }
}

void write_load(const Partition& partition, double ahead, const TickMeter& meter, v1::ServerLoad& answer) {
  for (const LoadPiece& piece : load_along_curve(partition, ahead, kLoadPiecesMax)) {
    v1::LoadPiece& message = *answer.add_pieces();
    *message.mutable_first() = to_proto(piece.first);
    message.set_level(piece.level);
    message.set_work(piece.work);
    message.set_sectors(piece.sectors);
    message.set_bodies(piece.bodies);
  }
  answer.set_tick_us(meter.usual_own_us());
  answer.set_wait_us(meter.usual_wait_us());
}

std::vector<v1::SnapshotChunk> snapshot_chunks(const Partition& partition, bool with_shared) {
  SectorChunks sectors;
  for_each_sector(partition, [&](MovedSector sector) { sectors.add(std::move(sector)); });
  std::vector<v1::SnapshotChunk> chunks = sectors.finish();
  if (with_shared) chunks.insert(chunks.begin(), shared_chunk(shared_state(partition)));
  return chunks;
}

}  // namespace

absl::Status QueryAnswers::check(const v1::Query& query) const {
  if (query.has_ray()) {
    const Eigen::Vector3d direction = from_proto(query.ray().direction());
    if (absl::Status status = finite("origin", from_proto(query.ray().origin()).local); !status.ok())
      return status;
    if (absl::Status status = finite("direction", direction); !status.ok()) return status;
    if (std::abs(direction.norm() - 1) > kUnitTolerance)
      return refused("a ray's direction has no unit length");
    return bounded("length", query.ray().length(), 0, kRayLengthMax, "m");
  }
  if (query.has_load()) return bounded("time ahead", query.load().ahead(), 0, kNoBound, "s");
  if (!query.has_near()) return absl::OkStatus();
  // As for a body.
  const absl::StatusOr<Shape> shape = probe_of(query.near());
  if (!shape.ok()) return shape.status();
  BodyDescription probe;
  probe.name = "probe";
  probe.properties.motion = Motion::kKinematic;
  probe.pose = from_proto(query.near().pose());
  WorldSettings settings;
  settings.sector_size = partition_.sector_size();
  if (absl::Status status = validate(probe, *shape, settings); !status.ok()) return status;
  return bounded("reach", query.near().reach(), 0, kNearReachMax * partition_.sector_size(), "m");
}

void QueryAnswers::answer(const v1::Query& query, Tick tick, bool with_shared, const TickMeter& meter) {
  v1::ClusterMessage message;
  v1::Answer& answer = *message.mutable_answer();
  answer.set_world(world_);
  answer.set_query(query.id());
  answer.set_tick(tick);
  if (query.has_snapshot()) return answer_with_snapshot(query, std::move(message), with_shared);
  if (query.has_hash()) write_hash(partition_, answer);
  if (query.has_ray()) write_hit(partition_, query.ray(), answer);
  if (query.has_load()) write_load(partition_, query.load().ahead(), meter, *answer.mutable_load());
  if (query.has_near()) write_near(partition_, query.near(), answer);
  send_(kCoordinatorNode, message);
}

// In answers of about the size of a chunk.
void QueryAnswers::answer_with_snapshot(const v1::Query& query, v1::ClusterMessage answer, bool with_shared) {
  std::vector<v1::ClusterMessage> answers;
  std::size_t room = 0;
  const auto take = [&](v1::SnapshotChunk chunk) {
    if (room == 0) {
      answers.push_back(answer);
      room = kSnapshotChunkBytes;
    }
    room -= std::min(room, chunk.ByteSizeLong());
    *answers.back().mutable_answer()->add_snapshot() = std::move(chunk);
  };
  if (query.snapshot().keeps()) {
    changed_chunks_.collect(partition_, query.snapshot().anew(), with_shared, take);
  } else {
    for (v1::SnapshotChunk& chunk : snapshot_chunks(partition_, with_shared)) take(std::move(chunk));
  }
  if (answers.empty()) answers.push_back(std::move(answer));
  for (v1::ClusterMessage& message : answers) {
    message.mutable_answer()->set_parts(static_cast<std::uint32_t>(answers.size()));
    send_(kCoordinatorNode, message);
  }
}

}  // namespace tessera
