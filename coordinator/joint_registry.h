// The coordinator's record of a world's joints: their names, properties and drives.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/btree_set.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "command.pb.h"
#include "coordinator/undo.h"
#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"
#include "lpss/snapshot/world_catalogue.h"

namespace tessera {

class JointRegistry {
 public:
  struct Entry {
    std::string name;
    JointRecord record;  // frames in centre frames; with the latest drives
  };

  // The joints of a valid world, with their records.
  JointRegistry(std::vector<JointDescription> joints, std::span<const JointRecord> records);

  // The joints of a valid catalogue, and back.
  explicit JointRegistry(const WorldCatalogue& catalogue);
  void describe(WorldCatalogue& catalogue) const;
  JointId next_id() const { return next_id_; }
  void skip_ids_below(JointId id) { next_id_ = std::max(next_id_, id); }

  // INVALID_ARGUMENT for an empty reference, NOT_FOUND for a joint that does not exist (or no longer exists).
  absl::StatusOr<JointId> resolve(const v1::JointRef& reference) const;

  // Null if there is none.
  const Entry* find(JointId id) const;

  // Those of which the body is parent or child, ascending by ids.
  std::vector<const Entry*> of(BodyId body) const;

  // A joint that ties the body to another one or to the world, the first by ids; null if there is none.
  const Entry* holding(BodyId body) const;

  // One whose child it is; null if there is none.
  const Entry* with_child(BodyId body) const;

  // At most `limit` joints whose names begin with `prefix`, ascending by id.
  std::vector<JointId> with_prefix(std::string_view prefix, std::size_t limit) const;

  // A name that is not in use, for a joint of that id.
  std::string free_name(JointId id) const;

  // Adds a new joint under the next id; ids are never reused. `joint.properties` refers to bodies by their
  // ids; these are the properties of those bodies; `parent` is null for the world. Errors as
  // WorldRegistry::add_joint().
  absl::StatusOr<JointRecord> add(JointDescription joint, const BodyProperties* parent,
                                  const BodyProperties& child, const WorldSettings& settings, Undo& undo);

  // RESOURCE_EXHAUSTED for so many more joints.
  absl::Status room(std::size_t joints) const;
  bool has_name(std::string_view name) const { return names_.contains(name); }
  // A valid joint, with the next id and a name that is not in use.
  void add(std::string name, const JointRecord& record, Undo& undo);

  // Axes that followed it follow nothing from then on.
  void remove(JointId id, Undo& undo);
  void remove_of(BodyId body, Undo& undo);
  void set_drives(JointId id, const JointDrives& drives, Undo& undo);
  // The motion of a body that is a parent has changed.
  void set_parent_motion(BodyId parent, Motion motion, Undo& undo);

 private:
  using Joints = std::map<JointId, Entry>;

  void insert(std::string name, const JointRecord& record);
  void link(const Entry& entry);
  void unlink(const Entry& entry);
  absl::Status leaders_check(const JointDescription& joint) const;
  // RESOURCE_EXHAUSTED for a further joint of this body; null: the world.
  absl::Status room_at(BodyId body, const BodyProperties* properties) const;

  Joints joints_;  // node addresses are stable: names_ refers to them
  absl::btree_map<std::string_view, JointId> names_;
  absl::btree_set<std::pair<BodyId, JointId>> by_body_;
  // Leaders with those that follow them, or did before they were removed.
  absl::btree_set<std::pair<JointId, JointId>> followers_;
  JointId next_id_{1};
};

}  // namespace tessera
