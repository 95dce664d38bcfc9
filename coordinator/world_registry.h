// The coordinator's record of a world's bodies and joints: names and properties, not positions.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/frame_registry.h"
#include "coordinator/joint_registry.h"
#include "coordinator/shape_table.h"
#include "coordinator/undo.h"
#include "lpss/model/body.h"
#include "lpss/model/world_description.h"
#include "lpss/snapshot/world_catalogue.h"
#include "lpss/tick/messages.h"
#include "query.pb.h"

namespace tessera {

class WorldRegistry {
 public:
  struct Entry {
    std::string name;
    BodyProperties properties;  // as simulated: see records_of()
    BodyTags tags;
  };

  // A valid world, with its records.
  WorldRegistry(const WorldDescription& world, std::span<const BodyRecord> records,
                std::span<const JointRecord> joints);

  // From a snapshot that is valid; and back, but for what is held.
  WorldRegistry(const WorldSnapshot& world, const WorldCatalogue& catalogue);
  WorldCatalogue catalogue() const;
  // Of it, the ids that come next.
  WorldCatalogue next_ids() const;
  // None below these is given any more.
  void skip_ids_below(BodyId body, JointId joint);
  // Counts what has changed the rest of it, and the shapes.
  std::uint64_t changes() const { return changes_; }

  const WorldSettings& settings() const { return settings_; }
  const ShapeTable& shapes() const { return shapes_; }
  ShapeTable& shapes() { return shapes_; }
  std::size_t body_count() const { return bodies_.size(); }

  // INVALID_ARGUMENT for an empty reference, or the name of a frame; NOT_FOUND for a body that does not exist
  // (or no longer exists).
  absl::StatusOr<BodyId> resolve(const v1::BodyRef& reference) const;

  // Null if there is none.
  const Entry* find(BodyId id) const;

  // Bodies whose names begin with `prefix`, ascending by id.
  std::vector<BodyId> with_prefix(std::string_view prefix) const;

  // What changes it below stays, or is taken back, up to the last call of either.
  void keep() { undo_.keep(); }
  void roll_back() { undo_.roll_back(); }

  // Adds the bodies, joints and frames of a model, which is there from tick `at` on. Errors as validate() and
  // record_of(), ALREADY_EXISTS for a name in use, RESOURCE_EXHAUSTED if ids, bodies, joints or shapes are
  // used up, or all shapes would have more than `shape_bytes_max` bytes; after an error, roll_back().
  struct Spawned {
    std::vector<BodyRecord> bodies;
    std::vector<JointRecord> joints;
    std::vector<v1::NumberedShape> new_shapes;  // those that the world did not have yet
    ProgramModules new_modules;                 // likewise
  };
  // The bodies are the `owner`'s.
  absl::StatusOr<Spawned> spawn(const v1::Spawn& spawn, Tick at, const std::string& owner = {},
                                std::size_t shape_bytes_max = std::numeric_limits<std::size_t>::max());

  const JointRegistry& joints() const { return joints_; }

  // Adds a new joint. Errors as validate() and joint_properties_of(), NOT_FOUND for a body that does not
  // exist, ALREADY_EXISTS for a name in use, RESOURCE_EXHAUSTED beyond kJointsMax or, of
  // a body, kJointsPerBodyMax, FAILED_PRECONDITION for one that follows a joint which a program may remove;
  // an error changes nothing.
  absl::StatusOr<JointRecord> add_joint(const v1::AddJoint& request);

  // The command that adds a joint to the world, which has just been added here.
  AddJoint addition_of(const JointRecord& joint) const;

  // The command that removes a body that exists, with its shape where no other body has it.
  RemoveBody removal_of(BodyId id) const;

  // What no server needs to know of a body that exists.
  void set_tags(BodyId id, BodyTags tags);

  // Applies the effect of a checked command, which servers carry out at tick `at`, on this record.
  void apply(const Command& command, Tick at);

  // Ascending by id, at most `limit` (0: kFoundBodiesDefault); a prefix that is empty finds all. Ids that no
  // body has are skipped.
  v1::FoundBodies find(const v1::FindBodies& query) const;
  v1::FoundJoints find(const v1::FindJoints& query) const;
  // Ascending by name, otherwise likewise.
  v1::FoundFrames find(const v1::FindFrames& query) const;

 private:
  void remove(BodyId id, Tick at);
  void change(BodyId id, const BodyProperties& properties);
  absl::Status check_names(const WorldDescription& model) const;
  absl::Status take_shapes(WorldDescription& model, const v1::Spawn& spawn, Tick at, std::size_t bytes_max,
                           Spawned& spawned);
  bool has_name(const std::string& name) const;
  absl::Status leaders_last(const JointProperties& joint) const;
  absl::StatusOr<BodyId> body_of_joint(const char* side, const v1::BodyRef& reference,
                                       BodyId otherwise) const;
  absl::Status check_room(std::size_t bodies) const;
  std::string name_for(BodyId id) const;
  absl::Status room_for_shape(const std::string& title, std::size_t bytes, std::size_t bytes_max) const;
  void insert(BodyId id, std::string name, const BodyProperties& properties, BodyTags tags);

  WorldSettings settings_;
  ShapeTable shapes_;
  Undo undo_;
  std::map<BodyId, Entry> bodies_;  // node addresses are stable: names_ refers to them
  absl::btree_map<std::string_view, BodyId> names_;
  BodyId next_id_{1};
  JointRegistry joints_;
  FrameRegistry frames_;
  std::uint64_t changes_ = 0;
};

}  // namespace tessera
