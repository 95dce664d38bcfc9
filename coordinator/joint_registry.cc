#include "coordinator/joint_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"

namespace tessera {

JointRegistry::JointRegistry(std::vector<JointDescription> joints, std::span<const JointRecord> records) {
  invariant(joints.size() == records.size(), "every joint of a world has a record");
  for (std::size_t n = 0; n < records.size(); ++n) insert(std::move(joints[n].name), records[n]);
}

JointRegistry::JointRegistry(const WorldCatalogue& catalogue) {
  for (const WorldCatalogue::Joint& joint : catalogue.joints) insert(joint.name, joint.record);
  next_id_ = catalogue.next_joint;
}

void JointRegistry::describe(WorldCatalogue& catalogue) const {
  for (const auto& [id, entry] : joints_) catalogue.joints.push_back({entry.name, entry.record});
}

void JointRegistry::insert(std::string name, const JointRecord& record) {
  const auto [entry, is_new] = joints_.emplace(record.id, Entry{std::move(name), record});
  invariant(is_new, "ids of joints are unique");
  link(entry->second);
  next_id_ = JointId{record.id.value + 1};
}

void JointRegistry::link(const Entry& entry) {
  const JointRecord& record = entry.record;
  invariant(names_.emplace(entry.name, record.id).second, "names of joints are unique");
  by_body_.emplace(record.properties.parent, record.id);
  by_body_.emplace(record.properties.child, record.id);
  for (const JointAxis& axis : axes_of(record.properties)) {
    if (axis.mimic.is_set()) followers_.insert({axis.mimic.leader, record.id});
  }
}

// What it follows stays in followers_: it is skipped there.
void JointRegistry::unlink(const Entry& entry) {
  const JointProperties& properties = entry.record.properties;
  by_body_.erase({properties.parent, entry.record.id});
  by_body_.erase({properties.child, entry.record.id});
  names_.erase(entry.name);
}

void JointRegistry::add(std::string name, const JointRecord& record, Undo& undo) {
  const JointId before = next_id_;
  insert(std::move(name), record);
  undo.add([this, id = record.id, before] {
    const auto found = joints_.find(id);
    unlink(found->second);
    joints_.erase(found);
    next_id_ = before;
  });
}

absl::Status JointRegistry::room(std::size_t joints) const {
  if (joints_.size() + joints <= kJointsMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the world has ", joints_.size(), " joints, and with ",
                                                   joints, " more it would have more than ", kJointsMax));
}

absl::StatusOr<JointId> JointRegistry::resolve(const v1::JointRef& reference) const {
  switch (reference.by_case()) {
    case v1::JointRef::kId:
      if (joints_.contains(JointId{reference.id()})) return JointId{reference.id()};
      return absl::NotFoundError(absl::StrCat("there is no joint with the id ", reference.id()));
    case v1::JointRef::kName: {
      const auto found = names_.find(reference.name());
      if (found != names_.end()) return found->second;
      return absl::NotFoundError(absl::StrCat("there is no joint with the name '", reference.name(), "'"));
    }
    case v1::JointRef::BY_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("joint: an id or a name must be set");
}

const JointRegistry::Entry* JointRegistry::find(JointId id) const {
  const auto found = joints_.find(id);
  return found == joints_.end() ? nullptr : &found->second;
}

std::vector<const JointRegistry::Entry*> JointRegistry::of(BodyId body) const {
  std::vector<const Entry*> joints;
  for (auto joint = by_body_.lower_bound({body, JointId{}}); joint != by_body_.end() && joint->first == body;
       ++joint)
    joints.push_back(find(joint->second));
  return joints;
}

const JointRegistry::Entry* JointRegistry::holding(BodyId body) const {
  const auto joint = by_body_.lower_bound({body, JointId{}});
  return joint != by_body_.end() && joint->first == body ? find(joint->second) : nullptr;
}

const JointRegistry::Entry* JointRegistry::with_child(BodyId body) const {
  for (auto joint = by_body_.lower_bound({body, JointId{}}); joint != by_body_.end() && joint->first == body;
       ++joint) {
    const Entry* entry = find(joint->second);
    if (entry->record.properties.child == body) return entry;
  }
  return nullptr;
}

std::vector<JointId> JointRegistry::with_prefix(std::string_view prefix, std::size_t limit) const {
  std::vector<JointId> ids;
  if (prefix.empty()) {
    for (auto joint = joints_.begin(); joint != joints_.end() && ids.size() < limit; ++joint) {
      ids.push_back(joint->first);
    }
    return ids;
  }
  for (auto name = names_.lower_bound(prefix); name != names_.end() && name->first.starts_with(prefix);
       ++name) {
    ids.push_back(name->second);
  }
  std::sort(ids.begin(), ids.end());
  if (ids.size() > limit) ids.resize(limit);
  return ids;
}

std::string JointRegistry::free_name(JointId id) const {
  const std::string name = absl::StrCat("joint_", id.value);
  std::string unique = name;
  for (int n = 2; names_.contains(unique); ++n) unique = absl::StrCat(name, "_", n);
  return unique;
}

absl::Status JointRegistry::room_at(BodyId body, const BodyProperties* properties) const {
  if (properties == nullptr || properties->motion == Motion::kStatic) return absl::OkStatus();
  const std::size_t joints = of(body).size();
  if (joints < kJointsPerBodyMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the body with the id ", body.value, " has ", joints,
                                                   " joints, and one that may move has at most ",
                                                   kJointsPerBodyMax));
}

absl::StatusOr<JointRecord> JointRegistry::add(JointDescription joint, const BodyProperties* parent,
                                               const BodyProperties& child, const WorldSettings& settings,
                                               Undo& undo) {
  if (absl::Status status = room(1); !status.ok()) return status;
  if (names_.contains(joint.name)) {
    return absl::AlreadyExistsError(absl::StrCat("joint '", joint.name, "': the name is in use"));
  }
  if (absl::Status status = validate(joint, parent, child, settings); !status.ok()) return status;
  if (absl::Status status = leaders_check(joint); !status.ok()) return status;
  for (const auto& [body, of_body] :
       {std::pair(joint.properties.parent, parent), {joint.properties.child, &child}}) {
    absl::Status status = room_at(body, of_body);
    if (status.ok()) continue;
    return absl::Status(status.code(), absl::StrCat("joint '", joint.name, "': ", status.message()));
  }
  absl::StatusOr<JointProperties> properties =
      joint_properties_of(joint.properties, parent, child, settings.sector_size);
  if (!properties.ok()) return properties.status();
  const Motion parent_motion = parent == nullptr ? Motion::kStatic : parent->motion;
  const JointRecord record{next_id_, *std::move(properties), parent_motion, joint.drives};
  add(std::move(joint.name), record, undo);
  return record;
}

// A new joint follows joints that are there, so that none ever follows itself.
absl::Status JointRegistry::leaders_check(const JointDescription& joint) const {
  for (const JointAxis& axis : axes_of(joint.properties)) {
    if (!axis.mimic.is_set()) continue;
    const Entry* leader = find(axis.mimic.leader);
    const absl::Status status =
        leader == nullptr ? absl::NotFoundError(absl::StrCat("mimic leader: there is no joint with the id ",
                                                             axis.mimic.leader.value))
                          : validate_mimic(axis.mimic, leader->record.properties.type);
    if (!status.ok()) return {status.code(), absl::StrCat("joint '", joint.name, "': ", status.message())};
  }
  return absl::OkStatus();
}

void JointRegistry::remove(JointId id, Undo& undo) {
  const auto found = joints_.find(id);
  if (found == joints_.end()) return;
  for (auto follower = followers_.lower_bound({id, JointId{}});
       follower != followers_.end() && follower->first == id; follower = followers_.erase(follower)) {
    const auto joint = joints_.find(follower->second);
    if (joint == joints_.end()) continue;
    std::array<JointAxis, 2>& axes = joint->second.record.properties.axes;
    undo.add([this, id, follower = follower->second, before = axes] {
      joints_.at(follower).record.properties.axes = before;
      followers_.insert({id, follower});
    });
    for (JointAxis& axis : axes) {
      if (axis.mimic.leader == id) axis.mimic = {};
    }
  }
  unlink(found->second);
  undo.add([this, node = joints_.extract(found)]() mutable {
    link(joints_.insert(std::move(node)).position->second);
  });
}

void JointRegistry::remove_of(BodyId body, Undo& undo) {
  for (auto first = by_body_.lower_bound({body, JointId{}}); first != by_body_.end() && first->first == body;
       first = by_body_.lower_bound({body, JointId{}})) {
    remove(first->second, undo);
  }
}

void JointRegistry::set_drives(JointId id, const JointDrives& drives, Undo& undo) {
  const auto found = joints_.find(id);
  if (found == joints_.end()) return;
  undo.add([this, id, before = std::exchange(found->second.record.drives, drives)] {
    joints_.at(id).record.drives = before;
  });
}

void JointRegistry::set_parent_motion(BodyId parent, Motion motion, Undo& undo) {
  for (auto joint = by_body_.lower_bound({parent, JointId{}});
       joint != by_body_.end() && joint->first == parent; ++joint) {
    JointRecord& record = joints_.at(joint->second).record;
    if (record.properties.parent != parent) continue;
    undo.add([this, id = record.id, before = std::exchange(record.parent_motion, motion)] {
      joints_.at(id).record.parent_motion = before;
    });
  }
}

}  // namespace tessera
