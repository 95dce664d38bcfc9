#include "coordinator/asked_queries.h"

#include <absl/container/btree_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "coordinator/element_name.h"
#include "coordinator/limits.h"
#include "coordinator/query_checks.h"
#include "lpss/model/checks.h"
#include "lpss/observe/world_hash.h"
#include "proto/body_columns.h"
#include "proto/convert.h"

namespace tessera {
namespace {

using Results = google::protobuf::RepeatedPtrField<v1::QueryResult>;
using Parts = std::vector<v1::PartialResult>;

// The nearest of all hits, or all of them, along a way from `origin`.
v1::RayHits merged(std::vector<v1::RayHits::Hit> hits, bool all, const WorldPosition& origin,
                   const Eigen::Vector3d& direction, const WorldRegistry& world) {
  std::sort(hits.begin(), hits.end(), [](const auto& x, const auto& y) {
    return std::pair(x.distance(), x.body()) < std::pair(y.distance(), y.body());
  });
  v1::RayHits result;
  result.set_hit(!hits.empty());
  std::set<std::uint64_t> bodies;  // servers may have the same static one
  for (v1::RayHits::Hit& hit : hits) {
    if (!bodies.insert(hit.body()).second) continue;
    if (const auto* entry = world.find(BodyId{hit.body()})) hit.set_name(entry->name);
    const Eigen::Vector3d way = hit.distance() * direction;
    const auto position = canonical(origin.sector, origin.local + way, world.settings().sector_size);
    if (position.ok()) *hit.mutable_position() = to_proto(*position);
    *result.add_hits() = std::move(hit);
    if (!all || result.hits_size() == kRayHitsMax) break;
  }
  return result;
}

std::vector<v1::RayHits::Hit> hits_of(Parts& parts, v1::RayHits* (v1::QueryResult::*field)()) {
  std::vector<v1::RayHits::Hit> hits;
  for (v1::PartialResult& part : parts) {
    for (v1::RayHits::Hit& hit : *(part.mutable_result()->*field)()->mutable_hits())
      hits.push_back(std::move(hit));
  }
  return hits;
}

v1::RayHits result_of(const v1::RayQuery& ray, Parts& parts, const WorldRegistry& world) {
  v1::RayHits result =
      merged(hits_of(parts, &v1::QueryResult::mutable_ray), ray.wanted() == v1::RayQuery::ALL,
             from_proto(ray.origin()), from_proto(ray.direction()), world);
  if (ray.wanted() == v1::RayQuery::ANY) result.clear_hits();
  return result;
}

v1::RayHits result_of(const v1::SweepQuery& sweep, Parts& parts, const WorldRegistry& world) {
  return merged(hits_of(parts, &v1::QueryResult::mutable_sweep), /*all=*/false,
                from_proto(sweep.pose().position()), from_proto(sweep.direction()), world);
}

v1::NearBodies result_of(const v1::NearQuery& near, const Parts& parts, const WorldRegistry& world) {
  absl::btree_map<std::uint64_t, double> distances;  // several servers may find the same static body
  for (const v1::PartialResult& part : parts) {
    for (const v1::NearBodies::Found& found : part.result().near().bodies()) {
      const auto [place, is_new] = distances.try_emplace(found.id(), found.distance());
      if (!is_new) place->second = std::min(place->second, found.distance());
    }
  }
  std::vector<std::pair<double, std::uint64_t>> nearest;
  for (const auto& [body, distance] : distances) nearest.emplace_back(distance, body);
  std::sort(nearest.begin(), nearest.end());
  v1::NearBodies result;
  result.set_truncated(nearest.size() > near.limit());
  if (nearest.size() > near.limit()) nearest.resize(near.limit());
  for (const auto& [distance, body] : nearest) {
    v1::NearBodies::Found& found = *result.add_bodies();
    found.set_id(body);
    found.set_distance(distance);
    if (const auto* entry = world.find(BodyId{body})) found.set_name(entry->name);
  }
  return result;
}

v1::HashResult hash_of(const Parts& parts) {
  WorldHash sum;
  for (const v1::PartialResult& part : parts) sum.add(WorldHash(part.hash_low(), part.hash_high()));
  v1::HashResult result;
  result.set_hash(sum.to_string());
  return result;
}

// Of all servers, ascending by ids.
absl::StatusOr<std::vector<BodyRow>> states_of(const Parts& parts) {
  std::vector<BodyRow> all;
  for (const v1::PartialResult& part : parts) {
    if (absl::Status status = append_rows(part.result().states(), all); !status.ok()) return status;
  }
  std::sort(all.begin(), all.end(), [](const BodyRow& x, const BodyRow& y) { return x.id < y.id; });
  return all;
}

v1::BodyColumns columns_of(const std::vector<BodyRow>& rows) {
  v1::BodyColumns columns;
  ColumnWriter writer(columns);
  for (const BodyRow& row : rows) writer.add(row);
  return columns;
}

// Joints of which a body is gone are left out.
v1::JointColumns joint_columns(const std::vector<JointRecord>& joints, const std::vector<BodyRow>& rows,
                               const WorldRegistry& world) {
  const double size = world.settings().sector_size;
  const auto row_of = [&](BodyId id) {
    const auto row = std::lower_bound(rows.begin(), rows.end(), id,
                                      [](const BodyRow& x, BodyId wanted) { return x.id < wanted; });
    return row != rows.end() && row->id == id ? &*row : nullptr;
  };
  // In its centre frame, relative to a sector nearby.
  const auto side = [&](const BodyRow& row, const SectorIndex& sector) {
    const Pose body{relative_to(row.pose.position, sector, size), row.pose.orientation};
    return JointSide{body * centre_frame(world.find(row.id)->properties), row.linear_velocity,
                     row.angular_velocity};
  };
  v1::JointColumns columns;
  for (const JointRecord& joint : joints) {
    const JointProperties& properties = joint.properties;
    const BodyRow* child = row_of(properties.child);
    const BodyRow* parent = row_of(properties.parent);
    const bool has_parent = properties.parent.value != 0;
    if (child == nullptr || world.find(child->id) == nullptr) continue;
    if (has_parent && (parent == nullptr || world.find(parent->id) == nullptr)) continue;
    const SectorIndex& sector = child->pose.position.sector;
    JointSide parent_side;
    parent_side.pose.position = metres_between(sector, properties.anchor, size);
    if (has_parent) parent_side = side(*parent, sector);
    const JointState state = joint_state(properties, parent_side, side(*child, sector));
    const int axes = axis_count(properties.type);
    columns.add_ids(joint.id.value);
    columns.add_axes(axes);
    columns.mutable_positions()->Add(state.position.begin(), state.position.begin() + axes);
    columns.mutable_rates()->Add(state.velocity.begin(), state.velocity.begin() + axes);
  }
  return columns;
}

}  // namespace

absl::StatusOr<AskedQueries> AskedQueries::checked(
    const google::protobuf::RepeatedPtrField<v1::Query>& queries, const WorldRegistry& world) {
  if (queries.size() > kQueriesPerListMax)
    return refused("queries: ", queries.size(), " elements must be at most ", kQueriesPerListMax);
  AskedQueries list;
  for (int place = 0; place < queries.size(); ++place) {
    list.results_.Add();
    if (absl::Status status = list.take(place, queries[place], world); !status.ok())
      return at_element(status, "queries", place, queries[place], queries.size());
  }
  return list;
}

AskedQueries::Item& AskedQueries::ask(int place, v1::Query query) {
  *asked_.add_all() = std::move(query);
  Item& item = items_.emplace_back();
  item.place = place;
  return item;
}

template <typename Checked>
absl::Status AskedQueries::ask(int place, absl::StatusOr<Checked> query, Checked* (v1::Query::*field)()) {
  if (!query.ok()) return query.status();
  v1::Query asked;
  *(asked.*field)() = *std::move(query);
  ask(place, std::move(asked));
  return absl::OkStatus();
}

absl::Status AskedQueries::take(int place, const v1::Query& query, const WorldRegistry& world) {
  v1::QueryResult& result = results_[place];
  switch (query.kind_case()) {
    case v1::Query::kRay:
      return ask(place, tessera::checked(query.ray(), world), &v1::Query::mutable_ray);
    case v1::Query::kSweep:
      return ask(place, tessera::checked(query.sweep(), world), &v1::Query::mutable_sweep);
    case v1::Query::kNear:
      return ask(place, tessera::checked(query.near(), world), &v1::Query::mutable_near);
    case v1::Query::kHash:
      ask(place, query);
      return absl::OkStatus();
    case v1::Query::kStates:
      ask_states(place, query.states(), world);
      return absl::OkStatus();
    case v1::Query::kJointStates:
      ask_joint_states(place, query.joint_states(), world);
      return absl::OkStatus();
    case v1::Query::kFindBodies:
      *result.mutable_find_bodies() = world.find(query.find_bodies());
      return absl::OkStatus();
    case v1::Query::kFindJoints:
      *result.mutable_find_joints() = world.find(query.find_joints());
      return absl::OkStatus();
    case v1::Query::kFindFrames:
      *result.mutable_find_frames() = world.find(query.find_frames());
      return absl::OkStatus();
    case v1::Query::KIND_NOT_SET:
      break;
  }
  return refused("a query of no known kind");
}

// Servers know no names.
void AskedQueries::ask_states(int place, const v1::StatesQuery& query, const WorldRegistry& world) {
  v1::Query asked;
  v1::StatesQuery& states = *asked.mutable_states();
  const bool all = query.ids().empty() && query.name_prefix().empty();
  if (!all) {
    std::set<std::uint64_t> ids(query.ids().begin(), query.ids().end());
    if (!query.name_prefix().empty()) {
      for (const BodyId id : world.with_prefix(query.name_prefix())) {
        if (world.find(id)->properties.motion != Motion::kStatic) ids.insert(id.value);
      }
    }
    ids.insert(0);  // no body: without any, all would be meant
    states.mutable_ids()->Add(ids.begin(), ids.end());
  }
  ask(place, std::move(asked));
}

void AskedQueries::ask_joint_states(int place, const v1::JointStatesQuery& query,
                                    const WorldRegistry& world) {
  std::set<JointId> ids;
  for (const std::uint64_t id : query.ids()) ids.insert(JointId{id});
  if (query.ids().empty() || !query.name_prefix().empty()) {
    for (const JointId id : world.joints().with_prefix(query.name_prefix(), kJointsMax)) ids.insert(id);
  }
  std::vector<JointRecord> joints;
  std::set<std::uint64_t> bodies{0};
  for (const JointId id : ids) {
    const JointRegistry::Entry* joint = world.joints().find(id);
    if (joint == nullptr) continue;
    joints.push_back(joint->record);
    bodies.insert({joint->record.properties.parent.value, joint->record.properties.child.value});
  }
  v1::Query asked;
  asked.mutable_states()->mutable_ids()->Add(bodies.begin(), bodies.end());
  ask(place, std::move(asked)).joints = std::move(joints);
}

absl::Status AskedQueries::add(v1::Answer answer) {
  if (answer.results_size() != asked_.all_size()) {
    return absl::InternalError(
        absl::StrCat("it answers ", answer.results_size(), " queries of ", asked_.all_size()));
  }
  for (std::size_t n = 0; n < items_.size(); ++n)
    items_[n].parts.push_back(std::move(*answer.mutable_results(static_cast<int>(n))));
  return absl::OkStatus();
}

void AskedQueries::forget_answers() {
  for (Item& item : items_) item.parts.clear();
}

absl::Status AskedQueries::finish(Item& item, const v1::Query& query, const WorldRegistry& world,
                                  v1::QueryResult& result) const {
  switch (query.kind_case()) {
    case v1::Query::kRay:
      *result.mutable_ray() = result_of(query.ray(), item.parts, world);
      return absl::OkStatus();
    case v1::Query::kSweep:
      *result.mutable_sweep() = result_of(query.sweep(), item.parts, world);
      return absl::OkStatus();
    case v1::Query::kNear:
      *result.mutable_near() = result_of(query.near(), item.parts, world);
      return absl::OkStatus();
    case v1::Query::kHash:
      *result.mutable_hash() = hash_of(item.parts);
      return absl::OkStatus();
    default:
      break;
  }
  const absl::StatusOr<std::vector<BodyRow>> rows = states_of(item.parts);
  if (!rows.ok()) return rows.status();
  if (item.joints) {
    *result.mutable_joint_states() = joint_columns(*item.joints, *rows, world);
  } else {
    *result.mutable_states() = columns_of(*rows);
  }
  return absl::OkStatus();
}

absl::StatusOr<Results> AskedQueries::results(const WorldRegistry& world) {
  for (std::size_t n = 0; n < items_.size(); ++n) {
    const v1::Query& query = asked_.all(static_cast<int>(n));
    if (absl::Status status = finish(items_[n], query, world, results_[items_[n].place]); !status.ok())
      return status;
  }
  return std::move(results_);
}

}  // namespace tessera
