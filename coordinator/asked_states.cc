// Queries whose results are made of states of bodies.
#include "coordinator/asked_states.h"

#include <algorithm>
#include <map>
#include <utility>

#include "coordinator/limits.h"
#include "proto/convert.h"

namespace tessera {
namespace {

v1::BodyColumns columns_of(const std::vector<BodyRow>& rows) {
  v1::BodyColumns columns;
  ColumnWriter writer(columns);
  for (const BodyRow& row : rows) writer.add(row);
  return columns;
}

// What servers have told of the efforts and reactions of joints.
class ToldLoads {
 public:
  explicit ToldLoads(const v1::JointStatesQuery& query)
      : efforts_(query.efforts()), reactions_(query.reactions()) {}

  bool is_asked() const { return efforts_ || reactions_; }

  // DATA_LOSS for columns of different lengths.
  absl::Status add(const v1::JointColumns& columns) {
    int effort = 0;
    int reaction = 0;
    for (int n = 0; n < columns.ids_size() && n < columns.axes_size(); ++n) {
      const int axes = std::clamp(static_cast<int>(columns.axes(n)), 0, 2);
      if (effort + axes > columns.efforts_size()) break;
      if (reactions_ && reaction + kReactionNumbers > columns.reactions_size()) break;
      JointLoads& loads = of_[columns.ids(n)];
      for (int axis = 0; axis < axes; ++axis)
        loads.effort[static_cast<std::size_t>(axis)] = columns.efforts(effort++);
      if (!reactions_) continue;
      for (double& force : loads.force) force = columns.reactions(reaction++);
      for (double& torque : loads.torque) torque = columns.reactions(reaction++);
    }
    if (effort == columns.efforts_size() && reaction == columns.reactions_size()) return absl::OkStatus();
    return absl::DataLossError("loads of joints in columns of different lengths");
  }

  // All 0 for a joint of which nobody has told.
  void write(JointId id, int axes, v1::JointColumns& columns) const {
    const auto found = of_.find(id.value);
    const JointLoads loads = found == of_.end() ? JointLoads{} : found->second;
    if (efforts_) columns.mutable_efforts()->Add(loads.effort.begin(), loads.effort.begin() + axes);
    if (!reactions_) return;
    columns.mutable_reactions()->Add(loads.force.begin(), loads.force.end());
    columns.mutable_reactions()->Add(loads.torque.begin(), loads.torque.end());
  }

 private:
  static constexpr int kReactionNumbers = 6;  // of a joint

  bool efforts_;
  bool reactions_;
  std::map<std::uint64_t, JointLoads> of_;
};

// Joints of which a body is gone are left out.
v1::JointColumns joint_columns(const std::vector<JointRecord>& joints, const std::vector<BodyRow>& rows,
                               const ToldLoads& loads, const WorldRegistry& world) {
  const double size = world.settings().sector_size;
  const auto side = [&](const BodyRow& row, const SectorIndex& sector) {
    return side_of(row, world.find(row.id)->properties, sector, size);
  };
  v1::JointColumns columns;
  for (const JointRecord& joint : joints) {
    const JointProperties& properties = joint.properties;
    const BodyRow* child = row_of(rows, properties.child);
    const BodyRow* parent = row_of(rows, properties.parent);
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
    loads.write(joint.id, axes, columns);
  }
  return columns;
}

}  // namespace

v1::Query ask_states_of(const std::set<std::uint64_t>& ids) {
  v1::Query asked;
  v1::StatesQuery& states = *asked.mutable_states();
  states.add_ids(0);  // no body: without any, all would be meant
  for (const std::uint64_t id : ids) {
    if (id != 0) states.add_ids(id);
  }
  return asked;
}

absl::StatusOr<std::vector<BodyRow>> states_of(const Parts& parts) {
  std::vector<BodyRow> all;
  for (const v1::PartialResult& part : parts) {
    if (absl::Status status = append_rows(part.result().states(), all); !status.ok()) return status;
  }
  std::sort(all.begin(), all.end(), [](const BodyRow& x, const BodyRow& y) { return x.id < y.id; });
  return all;
}

const BodyRow* row_of(std::span<const BodyRow> rows, BodyId id) {
  const auto row = std::ranges::lower_bound(rows, id, {}, &BodyRow::id);
  return row != rows.end() && row->id == id ? &*row : nullptr;
}

JointSide side_of(const BodyRow& row, const BodyProperties& properties, const SectorIndex& sector,
                  double sector_size) {
  const Pose body{relative_to(row.pose.position, sector, sector_size), row.pose.orientation};
  return {body * centre_frame(properties), row.linear_velocity, row.angular_velocity};
}

// Servers know no names.
absl::StatusOr<AskedQuery> ask(const v1::StatesQuery& query, const WorldRegistry& world) {
  AskedQuery ask;
  if (query.ids().empty() && query.name_prefix().empty()) {
    ask.asked.emplace_back().mutable_states();
  } else {
    std::set<std::uint64_t> ids(query.ids().begin(), query.ids().end());
    if (!query.name_prefix().empty()) {
      for (const BodyId id : world.with_prefix(query.name_prefix())) {
        if (world.find(id)->properties.motion != Motion::kStatic) ids.insert(id.value);
      }
    }
    ask.asked.push_back(ask_states_of(ids));
  }
  ask.finish = [](std::span<Parts> parts, const WorldRegistry&, v1::QueryResult& result) {
    const absl::StatusOr<std::vector<BodyRow>> rows = states_of(parts[0]);
    if (rows.ok()) *result.mutable_states() = columns_of(*rows);
    return rows.status();
  };
  return ask;
}

absl::StatusOr<AskedQuery> ask(const v1::JointStatesQuery& query, const WorldRegistry& world) {
  std::set<JointId> ids;
  for (const std::uint64_t id : query.ids()) ids.insert(JointId{id});
  if (query.ids().empty() || !query.name_prefix().empty()) {
    for (const JointId id : world.joints().with_prefix(query.name_prefix(), kJointsMax)) ids.insert(id);
  }
  std::vector<JointRecord> joints;
  std::set<std::uint64_t> bodies;
  for (const JointId id : ids) {
    const JointRegistry::Entry* joint = world.joints().find(id);
    if (joint == nullptr) continue;
    joints.push_back(joint->record);
    bodies.insert({joint->record.properties.parent.value, joint->record.properties.child.value});
  }
  AskedQuery ask;
  ask.asked.push_back(ask_states_of(bodies));
  ToldLoads loads(query);
  if (loads.is_asked()) {
    v1::JointStatesQuery& asked = *ask.asked.emplace_back().mutable_joint_states();
    asked.set_efforts(true);
    asked.set_reactions(query.reactions());
    for (const JointRecord& joint : joints) asked.add_ids(joint.id.value);
  }
  ask.finish = [joints = std::move(joints), loads = std::move(loads)](
                   std::span<Parts> parts, const WorldRegistry& now, v1::QueryResult& result) {
    const absl::StatusOr<std::vector<BodyRow>> rows = states_of(parts[0]);
    if (!rows.ok()) return rows.status();
    ToldLoads told = loads;
    for (const Parts& of_loads : parts.subspan(1)) {
      for (const v1::PartialResult& part : of_loads) {
        if (absl::Status status = told.add(part.result().joint_states()); !status.ok()) return status;
      }
    }
    *result.mutable_joint_states() = joint_columns(joints, *rows, told, now);
    return absl::OkStatus();
  };
  return ask;
}

}  // namespace tessera
