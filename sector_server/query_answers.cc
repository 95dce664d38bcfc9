#include "sector_server/query_answers.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "lpss/observe/contacts.h"
#include "lpss/observe/load.h"
#include "lpss/observe/queries.h"
#include "lpss/observe/state.h"
#include "lpss/programs/registry.h"
#include "proto/body_columns.h"
#include "proto/convert.h"
#include "proto/ray_columns.h"
#include "proto/snapshot.h"
#include "proto/wire.h"
#include "sector_server/contact_message.h"

namespace tessera {
namespace {

// Sectors, how far from a probe bodies are searched for: as far as the coordinator allows.
constexpr double kNearReachMax = 4;
constexpr double kUnitTolerance = 1e-6;
constexpr int kRaysBetweenLooks = 16;  // at the clock

absl::StatusOr<Shape> probe_of(const v1::Geometry& geometry) {
  v1::Shape probe;
  *probe.add_parts()->mutable_geometry() = geometry;
  absl::StatusOr<Shape> shape = from_proto(probe);
  if (!shape.ok()) return shape.status();
  if (absl::Status status = validate(*shape, "probe"); !status.ok()) return status;
  return shape;
}

// The probe of a query that was checked.
Geometry checked_probe(const v1::Geometry& geometry) {
  const absl::StatusOr<Shape> shape = probe_of(geometry);
  invariant(shape.ok(), "queries are checked as they come");
  return shape->parts.front().geometry;
}

// As for a body.
absl::Status check_probe(const v1::Geometry& geometry, const v1::WorldPose& pose,
                         const WorldSettings& settings) {
  const absl::StatusOr<Shape> shape = probe_of(geometry);
  if (!shape.ok()) return shape.status();
  BodyDescription probe;
  probe.name = "probe";
  probe.properties.motion = Motion::kKinematic;
  probe.pose = from_proto(pose);
  return validate(probe, *shape, settings);
}

absl::Status check_way(const Eigen::Vector3d& direction, double length) {
  if (absl::Status status = finite("direction", direction); !status.ok()) return status;
  if (std::abs(direction.norm() - 1) > kUnitTolerance) return refused("a direction has no unit length");
  return bounded("length", length, 0, kRayLengthMax, "m");
}

using Bodies = google::protobuf::RepeatedPtrField<v1::BodyRef>;

absl::Status check_ids(const char* what, const Bodies& bodies) {
  return ascend(what, bodies, [](const v1::BodyRef& body) { return body.id(); });
}

template <typename Query>
absl::Status check_except(const Query& query) {
  return check_ids("bodies to pass through", query.except());
}

// Each array has an element for each ray.
absl::Status check_rays(const v1::RaysQuery& query) {
  if (absl::Status status = check_except(query); !status.ok()) return status;
  const absl::StatusOr<RayReader> rays = RayReader::of(query);
  if (!rays.ok()) return rays.status();
  for (int n = 0; n < rays->size(); ++n) {
    const RayRow ray = (*rays)[n];
    if (absl::Status status = finite("origin", ray.origin.local); !status.ok()) return status;
    if (absl::Status status = check_way(ray.direction, ray.length); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status check_query(const v1::Query& query, const WorldSettings& settings) {
  switch (query.kind_case()) {
    case v1::Query::kRay:
      if (absl::Status status = finite("origin", from_proto(query.ray().origin()).local); !status.ok())
        return status;
      if (absl::Status status = check_except(query.ray()); !status.ok()) return status;
      return check_way(from_proto(query.ray().direction()), query.ray().length());
    case v1::Query::kRays:
      return check_rays(query.rays());
    case v1::Query::kSweep:
      if (absl::Status status = check_probe(query.sweep().probe(), query.sweep().pose(), settings);
          !status.ok())
        return status;
      if (absl::Status status = check_except(query.sweep()); !status.ok()) return status;
      return check_way(from_proto(query.sweep().direction()), query.sweep().length());
    case v1::Query::kNear:
      if (absl::Status status = check_probe(query.near().probe(), query.near().pose(), settings);
          !status.ok())
        return status;
      if (absl::Status status = check_except(query.near()); !status.ok()) return status;
      return bounded("reach", query.near().reach(), 0, kNearReachMax * settings.sector_size, "m");
    case v1::Query::kContacts:
      return check_ids("bodies that touch", query.contacts().bodies());
    case v1::Query::kStates:
    case v1::Query::kJointStates:
    case v1::Query::kHash:
    case v1::Query::kPrograms:
      return absl::OkStatus();
    default:
      return refused("a query of no kind that servers answer");
  }
}

void write_hash(const Partition& partition, v1::PartialResult& part) {
  const WorldHash hash = hash_of(partition);
  part.set_hash_low(hash.low());
  part.set_hash_high(hash.high());
  const WorldHash programs = program_hash_of(partition);
  part.set_programs_low(programs.low());
  part.set_programs_high(programs.high());
}

void write_numbers(std::span<const double> numbers, std::span<const NumberSpec> table,
                   google::protobuf::RepeatedPtrField<v1::NamedNumber>& result) {
  for (std::size_t n = 0; n < numbers.size() && n < table.size(); ++n) {
    v1::NamedNumber& number = *result.Add();
    number.set_name(std::string(table[n].name));
    number.set_value(numbers[n]);
  }
}

// Up to one more than are asked for.
void write_programs(const Partition& partition, const v1::ProgramsQuery& query, v1::FoundPrograms& result) {
  const auto write = [&](const ProgramsView& body) {
    for (std::uint32_t place = 0; place < body.programs.size(); ++place) {
      if (static_cast<std::uint64_t>(result.programs_size()) > query.limit()) return;
      const ProgramRecord& record = body.programs[place];
      const Program* const program = find_program(record.kind);
      if (program == nullptr) continue;
      v1::FoundPrograms::Found& found = *result.add_programs();
      found.set_body(body.id.value);
      found.set_program(place);
      found.set_kind(record.kind);
      found.set_program_name(record.name);
      found.set_fault(record.fault);
      write_numbers(record.parameters, program->parameters(), *found.mutable_parameters());
      write_numbers(record.inputs, program->inputs(), *found.mutable_inputs());
      write_numbers(record.values, program->values(), *found.mutable_values());
    }
  };
  for (const std::uint64_t id : query.ids()) {
    if (const std::optional<ProgramsView> body = programs_of(partition, BodyId{id})) write(*body);
  }
  if (query.ids().empty()) for_each_programmed(partition, write);
}

// Of a query that was checked: bodies are given by ids, ascending.
std::vector<BodyId> ids_of(const Bodies& bodies) {
  std::vector<BodyId> ids;
  ids.reserve(static_cast<std::size_t>(bodies.size()));
  for (const v1::BodyRef& body : bodies) ids.push_back(BodyId{body.id()});
  return ids;
}

void write_hit(const RayAnswer& hit, v1::RayHits& result) {
  v1::RayHits::Hit& told = *result.add_hits();
  told.set_body(hit.body.value);
  told.set_distance(hit.distance);
  *told.mutable_normal() = to_proto(hit.normal);
}

void write_hits(Queries& queries, const v1::RayQuery& ray, v1::RayHits& result) {
  const std::vector<BodyId> passed = ids_of(ray.except());
  const QueryFilter filter{ray.mask(), passed};
  const WorldPosition origin = from_proto(ray.origin());
  const Eigen::Vector3d direction = from_proto(ray.direction());
  if (ray.wanted() == v1::RayQuery::ALL) {
    for (const RayAnswer& hit : queries.raycast_all(origin, direction, ray.length(), filter))
      write_hit(hit, result);
  } else if (const auto hit = queries.raycast(origin, direction, ray.length(), filter)) {
    write_hit(*hit, result);
  }
}

// The bodies that a ray passes through: those of all rays, and its own. Valid until the next call.
class PassedByRay {
 public:
  explicit PassedByRay(const Bodies& bodies) : of_all_(ids_of(bodies)) {}

  std::span<const BodyId> with(BodyId own) {
    if (own.value == 0) return of_all_;
    passed_ = of_all_;
    const auto place = std::ranges::lower_bound(passed_, own);
    if (place == passed_.end() || *place != own) passed_.insert(place, own);
    return passed_;
  }

 private:
  std::vector<BodyId> of_all_;
  std::vector<BodyId> passed_;
};

// False where it stopped, after one ray at least, since that is all there is time for.
bool write_first_hits(Queries& queries, const v1::RaysQuery& query, const std::function<bool()>& is_late,
                      v1::HitColumns& result) {
  const absl::StatusOr<RayReader> rays = RayReader::of(query);
  invariant(rays.ok(), "queries are checked as they come");
  PassedByRay passed(query.except());
  result.mutable_bodies()->Reserve(rays->size());
  result.mutable_distances()->Reserve(rays->size());
  result.mutable_normals()->Reserve(3 * rays->size());
  for (int n = 0; n < rays->size(); ++n) {
    if (n > 0 && n % kRaysBetweenLooks == 0 && is_late()) return false;
    const RayRow ray = (*rays)[n];
    const QueryFilter filter{query.mask(), passed.with(ray.except)};
    const RayAnswer hit = queries.raycast(ray.origin, ray.direction, ray.length, filter)
                              .value_or(RayAnswer{{}, 0, Eigen::Vector3d::Zero()});
    result.add_bodies(hit.body.value);
    result.add_distances(hit.distance);
    result.mutable_normals()->Add(hit.normal.data(), hit.normal.data() + 3);
  }
  return true;
}

void write_touch(Queries& queries, const v1::SweepQuery& sweep, v1::RayHits& result) {
  const std::vector<BodyId> passed = ids_of(sweep.except());
  const auto touch = queries.sweep(checked_probe(sweep.probe()), from_proto(sweep.pose()),
                                   from_proto(sweep.direction()), sweep.length(), {sweep.mask(), passed});
  if (touch) write_hit(*touch, result);
}

void write_near(Queries& queries, const v1::NearQuery& query, v1::NearBodies& result) {
  const std::vector<BodyId> passed = ids_of(query.except());
  for (const NearBody& near : queries.bodies_near(checked_probe(query.probe()), from_proto(query.pose()),
                                                  query.reach(), {query.mask(), passed})) {
    v1::NearBodies::Found& body = *result.add_bodies();
    body.set_id(near.body.value);
    body.set_distance(near.distance);
  }
}

BodyRow row_of(const BodyRecord& body, double sector_size) {
  const BodyState& state = body.state;
  return {body.id, body_pose(body, sector_size), Eigen::Vector3d(state.linear_velocity.data()),
          Eigen::Vector3d(state.angular_velocity.data()), state.activity == Activity::kAsleep};
}

void write_states(const Partition& partition, const v1::StatesQuery& query, v1::BodyColumns& result) {
  ColumnWriter writer(result);
  const double size = partition.sector_size();
  if (query.ids().empty()) {
    for_each_body(partition, [&](const BodyRecord& body) { writer.add(row_of(body, size)); });
    return;
  }
  std::vector<BodyId> ids;
  ids.reserve(static_cast<std::size_t>(query.ids_size()));
  for (const std::uint64_t id : query.ids()) ids.push_back(BodyId{id});
  for (const BodyRecord& body : bodies_of(partition, ids)) writer.add(row_of(body, size));
}

// What joints gave and bore; the coordinator knows where they are from the states of their bodies.
void write_loads(const Partition& partition, const v1::JointStatesQuery& query, v1::JointColumns& result) {
  for (const std::uint64_t id : query.ids()) {
    const JointRecord* const joint = partition.joints.record(JointId{id});
    if (joint == nullptr) continue;
    const int axes = axis_count(joint->properties.type);
    const JointLoads& loads = joint->loads;
    result.add_ids(id);
    result.add_axes(static_cast<std::uint32_t>(axes));
    result.mutable_efforts()->Add(loads.effort.begin(), loads.effort.begin() + axes);
    if (!query.reactions()) continue;
    result.mutable_reactions()->Add(loads.force.begin(), loads.force.end());
    result.mutable_reactions()->Add(loads.torque.begin(), loads.torque.end());
  }
}

void write_contacts(Partition& partition, const v1::ContactsQuery& query, v1::FoundContacts& result) {
  for (const TouchingPatch& patch : contacts_of(partition, ids_of(query.bodies()))) {
    if (static_cast<std::uint64_t>(result.contacts_size()) == query.limit())
      return result.set_truncated(true);
    v1::Contact& contact = *result.add_contacts();
    contact = to_proto(patch.a, patch.b, patch);
    contact.set_phase(v1::Contact::PERSIST);
  }
}

void write_part(Partition& partition, Queries& queries, const v1::Query& query, v1::PartialResult& part) {
  switch (query.kind_case()) {
    case v1::Query::kRay:
      return write_hits(queries, query.ray(), *part.mutable_result()->mutable_ray());
    case v1::Query::kSweep:
      return write_touch(queries, query.sweep(), *part.mutable_result()->mutable_sweep());
    case v1::Query::kNear:
      return write_near(queries, query.near(), *part.mutable_result()->mutable_near());
    case v1::Query::kJointStates:
      return write_loads(partition, query.joint_states(), *part.mutable_result()->mutable_joint_states());
    case v1::Query::kContacts:
      return write_contacts(partition, query.contacts(), *part.mutable_result()->mutable_contacts());
    case v1::Query::kStates:
      return write_states(partition, query.states(), *part.mutable_result()->mutable_states());
    case v1::Query::kPrograms:
      return write_programs(partition, query.programs(), *part.mutable_result()->mutable_programs());
    default:
      return write_hash(partition, part);
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

absl::Status QueryAnswers::check(const v1::Question& question) const {
  if (question.has_load()) return bounded("time ahead", question.load().ahead(), 0, kNoBound, "s");
  for (const v1::Query& query : question.queries().all()) {
    if (absl::Status status = check_query(query, partition_.settings); !status.ok()) return status;
  }
  return absl::OkStatus();
}

void QueryAnswers::answer(const v1::Question& question, Tick tick, bool with_shared, const TickMeter& meter,
                          const Clock& clock) {
  v1::ClusterMessage message;
  v1::Answer& answer = *message.mutable_answer();
  answer.set_world(world_);
  answer.set_question(question.id());
  answer.set_tick(tick);
  if (question.has_snapshot())
    return answer_with_snapshot(question.snapshot(), std::move(message), with_shared);
  if (question.has_load()) write_load(partition_, question.load().ahead(), meter, *answer.mutable_load());
  if (question.has_queries()) answer_queries(question.queries(), clock, answer);
  send_(kCoordinatorNode, message);
}

// The first query whose bounds are not used up is answered whole, however long that takes; of rays in
// columns, the first few are.
void QueryAnswers::answer_queries(const v1::Queries& queries, const Clock& clock, v1::Answer& answer) {
  queries_.look_for_strays();
  const Nanoseconds work_max = std::chrono::microseconds(queries.work_us_max());
  const Nanoseconds before = bounded_work_;
  const Nanoseconds began = clock();
  Nanoseconds work{};
  const auto has_used_up = [&] { return work_max > Nanoseconds::zero() && before + work >= work_max; };
  const auto is_late = [&] {
    work = clock() - began;
    return has_used_up();
  };
  std::uint64_t bytes = 0;
  for (const v1::Query& query : queries.all()) {
    if (has_used_up()) answer.set_excess(v1::Answer::WORK);
    if (queries.bytes_max() > 0 && bytes > queries.bytes_max()) answer.set_excess(v1::Answer::BYTES);
    if (answer.excess() != v1::Answer::NONE) break;
    v1::PartialResult& part = *answer.add_results();
    if (!query.has_rays()) {
      write_part(partition_, queries_, query, part);
    } else if (!write_first_hits(queries_, query.rays(), is_late, *part.mutable_result()->mutable_rays())) {
      answer.set_excess(v1::Answer::WORK);
      break;
    }
    bytes += part.ByteSizeLong();
    work = clock() - began;
  }
  if (answer.excess() != v1::Answer::NONE) answer.clear_results();
  if (work_max > Nanoseconds::zero()) bounded_work_ += work;
  answer.set_work_us(static_cast<std::uint64_t>(work / std::chrono::microseconds(1)));
}

// In answers of about the size of a chunk.
void QueryAnswers::answer_with_snapshot(const v1::SnapshotQuery& query, v1::ClusterMessage answer,
                                        bool with_shared) {
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
  if (query.keeps()) {
    changed_chunks_.collect(partition_, query.anew(), with_shared, take);
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
