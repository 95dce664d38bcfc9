#include "coordinator/joint_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

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
  invariant(is_new && names_.emplace(entry->second.name, record.id).second,
            "ids and names of joints are unique");
  by_body_.emplace(record.properties.parent, record.id);
  by_body_.emplace(record.properties.child, record.id);
  for (const JointAxis& axis : axes_of(record.properties)) {
    if (axis.mimic.is_set()) followers_.insert({axis.mimic.leader, record.id});
  }
  next_id_ = JointId{record.id.value + 1};
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

const JointRegistry::Entry* JointRegistry::holding(BodyId body) const {
  const auto joint = by_body_.lower_bound({body, JointId{}});
  return joint != by_body_.end() && joint->first == body ? find(joint->second) : nullptr;
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

std::string JointRegistry::free_name() const {
  const std::string name = absl::StrCat("joint_", next_id_.value);
  std::string unique = name;
  for (int n = 2; names_.contains(unique); ++n) unique = absl::StrCat(name, "_", n);
  return unique;
}

absl::StatusOr<JointRecord> JointRegistry::add(JointDescription joint, const BodyProperties* parent,
                                               const BodyProperties& child, const WorldSettings& settings) {
  if (joints_.size() >= kJointsMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the world has ", joints_.size(), " joints, and may have ", kJointsMax));
  }
  if (names_.contains(joint.name)) {
    return absl::AlreadyExistsError(absl::StrCat("joint '", joint.name, "': the name is in use"));
  }
  if (absl::Status status = validate(joint, parent, child, settings); !status.ok()) return status;
  if (absl::Status status = leaders_check(joint); !status.ok()) return status;
  absl::StatusOr<JointProperties> properties =
      joint_properties_of(joint.properties, parent, child, settings.sector_size);
  if (!properties.ok()) return properties.status();
  const Motion parent_motion = parent == nullptr ? Motion::kStatic : parent->motion;
  const JointRecord record{next_id_, *std::move(properties), parent_motion, joint.drives};
  insert(std::move(joint.name), record);
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

void JointRegistry::remove(JointId id) {
  const auto found = joints_.find(id);
  if (found == joints_.end()) return;
  for (auto follower = followers_.lower_bound({id, JointId{}});
       follower != followers_.end() && follower->first == id; follower = followers_.erase(follower)) {
    const auto joint = joints_.find(follower->second);
    if (joint == joints_.end()) continue;
    for (JointAxis& axis : joint->second.record.properties.axes) {
      if (axis.mimic.leader == id) axis.mimic = {};
    }
  }
  const JointProperties& properties = found->second.record.properties;
  by_body_.erase({properties.parent, id});
  by_body_.erase({properties.child, id});
  names_.erase(found->second.name);
  joints_.erase(found);
}

void JointRegistry::remove_of(BodyId body) {
  for (auto first = by_body_.lower_bound({body, JointId{}}); first != by_body_.end() && first->first == body;
       first = by_body_.lower_bound({body, JointId{}})) {
    remove(first->second);
  }
}

void JointRegistry::set_drives(JointId id, const JointDrives& drives) {
  const auto found = joints_.find(id);
  if (found != joints_.end()) found->second.record.drives = drives;
}

}  // namespace tessera
