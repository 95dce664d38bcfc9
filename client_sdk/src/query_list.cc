#include "client_sdk/src/query_list.h"

#include <algorithm>
#include <utility>

#include "client_sdk/src/body_sample.h"
#include "client_sdk/src/contact_sample.h"
#include "client_sdk/src/references.h"
#include "proto/body_columns.h"
#include "proto/convert.h"
#include "proto/ray_columns.h"
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
    result.bodies.push_back(
        {BodyId{found.id()}, found.name(), *std::move(properties), found.user_data(), found.owner()});
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

std::vector<NamedNumber> named_numbers(const google::protobuf::RepeatedPtrField<v1::NamedNumber>& from) {
  std::vector<NamedNumber> numbers;
  for (const v1::NamedNumber& number : from) numbers.push_back({number.name(), number.value()});
  return numbers;
}

template <typename Row>
struct Rows {
  absl::Status status;
  std::vector<Row> rows;
};

template <typename Row, typename Columns>
Rows<Row> rows_of(const Columns& columns) {
  Rows<Row> result;
  result.status = append_rows(columns, result.rows);
  return result;
}

// Whether joints have as many values as they say.
bool agree(const v1::JointColumns& columns) {
  std::int64_t values = 0;
  for (const std::uint32_t axes : columns.axes()) values += axes;
  const auto has = [](int size, std::int64_t all) { return size == 0 || size == all; };
  return columns.axes_size() == columns.ids_size() && columns.positions_size() == values &&
         columns.rates_size() == values && has(columns.efforts_size(), values) &&
         has(columns.reactions_size(), 6 * std::int64_t{columns.ids_size()});
}

// Whether there are as many numbers as degrees of freedom ask for.
bool agree(const v1::Dynamics& dynamics) {
  const std::int64_t freedoms = dynamics.velocities_size();
  const auto has = [](int size, std::int64_t all) { return size == 0 || size == all; };
  return dynamics.freedoms_size() == dynamics.joints_size() && dynamics.bias_size() == freedoms &&
         has(dynamics.efforts_size(), freedoms) && has(dynamics.mass_matrix_size(), freedoms * freedoms) &&
         (freedoms > 0 ? dynamics.jacobians_size() % (6 * freedoms) == 0 : dynamics.jacobians_size() == 0);
}

// Whether there is a hit, or that there is none, for each ray.
absl::Status check(const v1::RaysQuery& rays, const v1::HitColumns& hits) {
  const absl::StatusOr<RayReader> asked = RayReader::of(rays);
  if (!asked.ok()) return asked.status();
  if (hits.bodies_size() != asked->size())
    return absl::DataLossError("the answer has another number of rays than the query");
  return rows_of<HitRow>(hits).status;
}

absl::Status check(const v1::Query& query, const v1::QueryResult& result) {
  switch (result.kind_case()) {
    case v1::QueryResult::kRays:
      return check(query.rays(), result.rays());
    case v1::QueryResult::kStates:
      return rows_of<BodyRow>(result.states()).status;
    case v1::QueryResult::kJointStates:
      if (agree(result.joint_states())) return absl::OkStatus();
      return absl::DataLossError("states of joints in columns of different lengths");
    case v1::QueryResult::kDynamics:
      if (agree(result.dynamics())) return absl::OkStatus();
      return absl::DataLossError("dynamics of other sizes than the degrees of freedom");
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
    if (absl::Status status = check(request.queries(n), reply.results(n)); !status.ok()) return status;
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

QueryPlace<std::vector<std::optional<FirstHit>>> QueryList::rays(const RaysQuery& rays) {
  v1::RaysQuery& query = *request_->add_queries()->mutable_rays();
  RayWriter writer(query);
  writer.reserve(static_cast<int>(rays.rays.size()));
  for (const RaysQuery::Ray& ray : rays.rays) writer.add({ray.origin, ray.direction, ray.length, ray.except});
  take_filter(rays, query);
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

QueryPlace<std::vector<JointValues>> QueryList::joint_states(const JointStatesQuery& wanted) {
  v1::JointStatesQuery& query = *request_->add_queries()->mutable_joint_states();
  for (const JointId id : wanted.ids) query.add_ids(id.value);
  query.set_name_prefix(wanted.prefix);
  query.set_efforts(wanted.efforts);
  query.set_reactions(wanted.reactions);
  return {request_->queries_size() - 1};
}

QueryPlace<FoundContacts> QueryList::contacts(const ContactsQuery& wanted) {
  v1::ContactsQuery& query = *request_->add_queries()->mutable_contacts();
  for (const BodyName& body : wanted.bodies) *query.add_bodies() = reference_to(body);
  query.set_name_prefix(wanted.prefix);
  query.set_limit(wanted.limit);
  return {request_->queries_size() - 1};
}

QueryPlace<std::optional<BodyDistance>> QueryList::distance(const DistanceQuery& wanted) {
  v1::DistanceQuery& query = *request_->add_queries()->mutable_distance();
  *query.mutable_a() = reference_to(wanted.a);
  *query.mutable_b() = reference_to(wanted.b);
  query.set_reach(wanted.reach);
  return {request_->queries_size() - 1};
}

QueryPlace<Dynamics> QueryList::dynamics(const DynamicsQuery& wanted) {
  v1::DynamicsQuery& query = *request_->add_queries()->mutable_dynamics();
  if (wanted.body) {
    *query.mutable_body() = reference_to(*wanted.body);
  } else if (wanted.joint) {
    *query.mutable_joint() = reference_to(*wanted.joint);
  }
  query.mutable_accelerations()->Add(wanted.accelerations.begin(), wanted.accelerations.end());
  for (const BodyPoint& point : wanted.points) {
    v1::DynamicsQuery::Point& added = *query.add_points();
    *added.mutable_body() = reference_to(point.body);
    *added.mutable_local() = tessera::to_proto(point.local);
  }
  query.set_mass_matrix(wanted.mass_matrix);
  return {request_->queries_size() - 1};
}

QueryPlace<FoundPrograms> QueryList::programs(const ProgramsQuery& wanted) {
  v1::ProgramsQuery& query = *request_->add_queries()->mutable_programs();
  for (const BodyId id : wanted.ids) query.add_ids(id.value);
  query.set_name_prefix(wanted.prefix);
  query.set_limit(wanted.limit);
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

std::vector<std::optional<FirstHit>> Answers::operator[](
    QueryPlace<std::vector<std::optional<FirstHit>>> place) const {
  std::vector<std::optional<FirstHit>> hits;
  for (const HitRow& row : rows_of<HitRow>(reply_->results(place.place).rays()).rows) {
    hits.emplace_back();
    if (row.body.value != 0) hits.back() = FirstHit{row.body, row.distance, row.position, row.normal};
  }
  return hits;
}

std::vector<Neighbour> Answers::operator[](QueryPlace<std::vector<Neighbour>> place) const {
  std::vector<Neighbour> neighbours;
  for (const v1::NearBodies::Found& found : reply_->results(place.place).near().bodies())
    neighbours.push_back({BodyId{found.id()}, found.name(), found.distance()});
  return neighbours;
}

std::vector<BodySample> Answers::operator[](QueryPlace<std::vector<BodySample>> place) const {
  std::vector<BodySample> samples;
  for (const BodyRow& row : rows_of<BodyRow>(reply_->results(place.place).states()).rows)
    samples.push_back(sample_of(row));
  return samples;
}

std::vector<JointValues> Answers::operator[](QueryPlace<std::vector<JointValues>> place) const {
  const v1::JointColumns& columns = reply_->results(place.place).joint_states();
  std::vector<JointValues> joints;
  auto position = columns.positions().begin();
  auto rate = columns.rates().begin();
  auto effort = columns.efforts().begin();
  const double* reaction = columns.reactions().data();
  for (int n = 0; n < columns.ids_size(); ++n) {
    const int axes = static_cast<int>(columns.axes(n));
    JointValues& joint = joints.emplace_back(
        JointValues{JointId{columns.ids(n)}, {position, position + axes}, {rate, rate + axes}});
    position += axes;
    rate += axes;
    if (columns.efforts_size() > 0) {
      joint.efforts.assign(effort, effort + axes);
      effort += axes;
    }
    if (columns.reactions_size() == 0) continue;
    joint.force = Eigen::Map<const Eigen::Vector3d>(reaction);
    joint.torque = Eigen::Map<const Eigen::Vector3d>(reaction + 3);
    reaction += 6;
  }
  return joints;
}

FoundContacts Answers::operator[](QueryPlace<FoundContacts> place) const {
  const v1::FoundContacts& found = reply_->results(place.place).contacts();
  FoundContacts result{{}, found.truncated()};
  for (const v1::Contact& contact : found.contacts()) result.contacts.push_back(contact_sample(contact));
  return result;
}

std::optional<BodyDistance> Answers::operator[](QueryPlace<std::optional<BodyDistance>> place) const {
  const v1::Distance& found = reply_->results(place.place).distance();
  if (found.beyond()) return std::nullopt;
  return BodyDistance{found.distance(), from_proto(found.on_a()), from_proto(found.on_b()),
                      from_proto(found.normal())};
}

Dynamics Answers::operator[](QueryPlace<Dynamics> place) const {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const v1::Dynamics& from = reply_->results(place.place).dynamics();
  const auto vector = [](const google::protobuf::RepeatedField<double>& numbers) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXd>(numbers.data(), numbers.size());
  };
  Dynamics dynamics;
  dynamics.base = BodyId{from.base()};
  for (const std::uint64_t id : from.joints()) dynamics.joints.push_back(JointId{id});
  dynamics.freedoms.assign(from.freedoms().begin(), from.freedoms().end());
  dynamics.velocities = vector(from.velocities());
  dynamics.bias = vector(from.bias());
  dynamics.efforts = vector(from.efforts());
  const Eigen::Index freedoms = from.velocities_size();
  if (from.mass_matrix_size() > 0)
    dynamics.mass_matrix = Eigen::Map<const RowMajor>(from.mass_matrix().data(), freedoms, freedoms);
  for (int first = 0; first < from.jacobians_size(); first += static_cast<int>(6 * freedoms))
    dynamics.jacobians.push_back(Eigen::Map<const RowMajor>(from.jacobians().data() + first, 6, freedoms));
  return dynamics;
}

FoundPrograms Answers::operator[](QueryPlace<FoundPrograms> place) const {
  const v1::FoundPrograms& from = reply_->results(place.place).programs();
  FoundPrograms result;
  result.truncated = from.truncated();
  for (const v1::FoundPrograms::Found& found : from.programs()) {
    result.programs.push_back({BodyId{found.body()}, found.name(), found.program(), found.kind(),
                               named_numbers(found.parameters()), named_numbers(found.inputs()),
                               named_numbers(found.values()), found.fault(), found.program_name()});
  }
  return result;
}

std::string Answers::operator[](QueryPlace<std::string> place) const {
  return reply_->results(place.place).hash().hash();
}

std::string Answers::program_hash(QueryPlace<std::string> place) const {
  return reply_->results(place.place).hash().programs();
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
