#include "client_sdk/src/query_list.h"

#include <algorithm>
#include <utility>

#include "client_sdk/src/body_sample.h"
#include "client_sdk/src/references.h"
#include "proto/body_columns.h"
#include "proto/convert.h"
#include "tessera/batch.h"

namespace tessera {
namespace {

template <typename Query>
void take_filter(const Query& from, auto& to) {
  to.set_mask(from.mask);
  for (const BodyName& body : from.except) *to.add_except() = reference_to(body);
}

v1::Geometry to_proto(const Geometry& probe) {
  return tessera::to_proto(Shape{{{probe, {}}}}).parts(0).geometry();
}

v1::RayQuery to_proto(const RayQuery& ray, v1::RayQuery::Wanted wanted) {
  v1::RayQuery query;
  *query.mutable_origin() = tessera::to_proto(ray.origin);
  *query.mutable_direction() = tessera::to_proto(ray.direction);
  query.set_length(ray.length);
  query.set_wanted(wanted);
  take_filter(ray, query);
  return query;
}

std::vector<RayResult> read(const v1::RayHits& hits) {
  std::vector<RayResult> results;
  for (const v1::RayHits::Hit& hit : hits.hits()) {
    results.push_back({BodyId{hit.body()}, hit.name(), hit.distance(), from_proto(hit.position()),
                       from_proto(hit.normal())});
  }
  return results;
}

absl::StatusOr<FoundJoint> read(const v1::FoundJoints::Found& found) {
  absl::StatusOr<JointDescription> joint = from_proto(found.joint());
  if (!joint.ok()) return joint.status();
  return FoundJoint{JointId{found.id()},
                    *std::move(joint),
                    found.parent(),
                    found.child(),
                    from_proto(found.parent_centre()),
                    from_proto(found.child_centre())};
}

absl::StatusOr<FoundBodies> read(const v1::FoundBodies& from) {
  FoundBodies result;
  result.truncated = from.truncated();
  for (const v1::FoundBodies::Found& found : from.bodies()) {
    absl::StatusOr<BodyProperties> properties = from_proto(found.properties());
    if (!properties.ok()) return properties.status();
    result.bodies.push_back({BodyId{found.id()}, found.name(), *std::move(properties)});
  }
  for (const auto& [id, described] : from.shapes()) {
    absl::StatusOr<Shape> shape = from_proto(described);
    if (!shape.ok()) return shape.status();
    result.shapes.emplace(id, *std::move(shape));
  }
  return result;
}

absl::StatusOr<FoundJoints> read(const v1::FoundJoints& from) {
  FoundJoints result;
  result.truncated = from.truncated();
  for (const v1::FoundJoints::Found& found : from.joints()) {
    absl::StatusOr<FoundJoint> joint = read(found);
    if (!joint.ok()) return joint.status();
    result.joints.push_back(*std::move(joint));
  }
  return result;
}

struct Rows {
  absl::Status status;
  std::vector<BodyRow> rows;
};

Rows rows_of(const v1::BodyColumns& columns) {
  Rows result;
  result.status = append_rows(columns, result.rows);
  return result;
}

// Whether joints have as many values as they say.
bool agree(const v1::JointColumns& columns) {
  std::int64_t values = 0;
  for (const std::uint32_t axes : columns.axes()) values += axes;
  return columns.axes_size() == columns.ids_size() && columns.positions_size() == values &&
         columns.rates_size() == values;
}

absl::Status check(const v1::QueryResult& result) {
  switch (result.kind_case()) {
    case v1::QueryResult::kStates:
      return rows_of(result.states()).status;
    case v1::QueryResult::kJointStates:
      if (agree(result.joint_states())) return absl::OkStatus();
      return absl::DataLossError("states of joints in columns of different lengths");
    case v1::QueryResult::kFindBodies:
      return read(result.find_bodies()).status();
    case v1::QueryResult::kFindJoints:
      return read(result.find_joints()).status();
    default:
      return absl::OkStatus();
  }
}

}  // namespace

absl::Status check_results(const v1::Request& request, const v1::Reply& reply) {
  if (reply.results_size() != request.queries_size())
    return absl::DataLossError("there are more queries than results, or less");
  for (int n = 0; n < reply.results_size(); ++n) {
    if (static_cast<int>(reply.results(n).kind_case()) != static_cast<int>(request.queries(n).kind_case()))
      return absl::DataLossError("a result of another kind than its query");
    if (absl::Status status = check(reply.results(n)); !status.ok()) return status;
  }
  return absl::OkStatus();
}

QueryList::QueryList() : request_(std::make_unique<v1::Request>()) {}
QueryList::~QueryList() = default;
QueryList::QueryList(QueryList&&) noexcept = default;
QueryList& QueryList::operator=(QueryList&&) noexcept = default;

std::size_t QueryList::size() const { return static_cast<std::size_t>(request_->queries_size()); }

QueryPlace<std::vector<RayResult>> QueryList::ray(const RayQuery& ray) {
  *request_->add_queries()->mutable_ray() = to_proto(ray, v1::RayQuery::FIRST);
  return {request_->queries_size() - 1};
}

QueryPlace<std::vector<RayResult>> QueryList::ray_all(const RayQuery& ray) {
  *request_->add_queries()->mutable_ray() = to_proto(ray, v1::RayQuery::ALL);
  return {request_->queries_size() - 1};
}

QueryPlace<bool> QueryList::ray_any(const RayQuery& ray) {
  *request_->add_queries()->mutable_ray() = to_proto(ray, v1::RayQuery::ANY);
  return {request_->queries_size() - 1};
}

QueryPlace<std::vector<RayResult>> QueryList::sweep(const SweepQuery& sweep) {
  v1::SweepQuery& query = *request_->add_queries()->mutable_sweep();
  *query.mutable_pose() = tessera::to_proto(sweep.pose);
  *query.mutable_probe() = to_proto(sweep.probe);
  *query.mutable_direction() = tessera::to_proto(sweep.direction);
  query.set_length(sweep.length);
  take_filter(sweep, query);
  return {request_->queries_size() - 1};
}

QueryPlace<std::vector<Neighbour>> QueryList::near(const NearQuery& near) {
  v1::NearQuery& query = *request_->add_queries()->mutable_near();
  *query.mutable_pose() = tessera::to_proto(near.pose);
  if (near.probe) *query.mutable_probe() = to_proto(*near.probe);
  query.set_reach(near.reach);
  query.set_limit(near.limit);
  take_filter(near, query);
  return {request_->queries_size() - 1};
}

QueryPlace<std::vector<BodySample>> QueryList::states(const std::vector<BodyId>& ids,
                                                      const std::string& prefix) {
  v1::StatesQuery& query = *request_->add_queries()->mutable_states();
  for (const BodyId id : ids) query.add_ids(id.value);
  query.set_name_prefix(prefix);
  return {request_->queries_size() - 1};
}

QueryPlace<std::vector<JointValues>> QueryList::joint_states(const std::vector<JointId>& ids,
                                                             const std::string& prefix) {
  v1::JointStatesQuery& query = *request_->add_queries()->mutable_joint_states();
  for (const JointId id : ids) query.add_ids(id.value);
  query.set_name_prefix(prefix);
  return {request_->queries_size() - 1};
}

QueryPlace<std::string> QueryList::hash() {
  request_->add_queries()->mutable_hash();
  return {request_->queries_size() - 1};
}

QueryPlace<FoundBodies> QueryList::find_bodies(const BodyQuery& wanted) {
  v1::FindBodies& query = *request_->add_queries()->mutable_find_bodies();
  query.set_name_prefix(wanted.prefix);
  for (const BodyId& id : wanted.ids) query.add_ids(id.value);
  query.set_only_static(wanted.only_static);
  query.set_with_shapes(wanted.with_shapes);
  query.set_limit(wanted.limit);
  return {request_->queries_size() - 1};
}

QueryPlace<FoundJoints> QueryList::find_joints(const std::string& prefix, std::uint64_t limit) {
  v1::FindJoints& query = *request_->add_queries()->mutable_find_joints();
  query.set_name_prefix(prefix);
  query.set_limit(limit);
  return {request_->queries_size() - 1};
}

QueryPlace<FoundFrames> QueryList::find_frames(const std::string& prefix, std::uint64_t limit) {
  v1::FindFrames& query = *request_->add_queries()->mutable_find_frames();
  query.set_name_prefix(prefix);
  query.set_limit(limit);
  return {request_->queries_size() - 1};
}

Tick Answers::tick() const { return reply_->tick(); }

Applied Answers::applied() const {
  Applied applied{reply_->applied().tick(), {}};
  for (const v1::Created& created : reply_->applied().created()) {
    applied.created.push_back({created.command(), BodyId{created.first_body()}, created.bodies(),
                               JointId{created.first_joint()}, created.joints()});
  }
  return applied;
}

std::vector<RayResult> Answers::operator[](QueryPlace<std::vector<RayResult>> place) const {
  const v1::QueryResult& result = reply_->results(place.place);
  return read(result.has_sweep() ? result.sweep() : result.ray());
}

bool Answers::operator[](QueryPlace<bool> place) const { return reply_->results(place.place).ray().hit(); }

std::vector<Neighbour> Answers::operator[](QueryPlace<std::vector<Neighbour>> place) const {
  std::vector<Neighbour> neighbours;
  for (const v1::NearBodies::Found& found : reply_->results(place.place).near().bodies())
    neighbours.push_back({BodyId{found.id()}, found.name(), found.distance()});
  return neighbours;
}

std::vector<BodySample> Answers::operator[](QueryPlace<std::vector<BodySample>> place) const {
  std::vector<BodySample> samples;
  for (const BodyRow& row : rows_of(reply_->results(place.place).states()).rows)
    samples.push_back(sample_of(row));
  return samples;
}

std::vector<JointValues> Answers::operator[](QueryPlace<std::vector<JointValues>> place) const {
  const v1::JointColumns& columns = reply_->results(place.place).joint_states();
  std::vector<JointValues> joints;
  auto position = columns.positions().begin();
  auto rate = columns.rates().begin();
  for (int n = 0; n < columns.ids_size(); ++n) {
    const int axes = static_cast<int>(columns.axes(n));
    joints.push_back({JointId{columns.ids(n)}, {position, position + axes}, {rate, rate + axes}});
    position += axes;
    rate += axes;
  }
  return joints;
}

std::string Answers::operator[](QueryPlace<std::string> place) const {
  return reply_->results(place.place).hash().hash();
}

FoundBodies Answers::operator[](QueryPlace<FoundBodies> place) const {
  return *read(reply_->results(place.place).find_bodies());
}

FoundJoints Answers::operator[](QueryPlace<FoundJoints> place) const {
  return *read(reply_->results(place.place).find_joints());
}

FoundFrames Answers::operator[](QueryPlace<FoundFrames> place) const {
  const v1::FoundFrames& from = reply_->results(place.place).find_frames();
  FoundFrames result;
  result.truncated = from.truncated();
  for (const v1::FoundFrames::Found& found : from.frames()) {
    const v1::Frame& frame = found.frame();
    result.frames.push_back({frame.name(), BodyId{frame.body()}, found.body(), from_proto(frame.pose())});
  }
  return result;
}

}  // namespace tessera
