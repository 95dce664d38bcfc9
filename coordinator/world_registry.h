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
#include "lpss/model/body.h"
#include "lpss/model/world_description.h"
#include "lpss/snapshot/world_catalogue.h"
#include "lpss/tick/messages.h"
#include "tessera.pb.h"

namespace tessera {

class WorldRegistry {
 public:
  struct Entry {
    std::string name;
    BodyProperties properties;  // as simulated: see records_of()
  };

  // A valid world, with its records.
  WorldRegistry(const WorldDescription& world, std::span<const BodyRecord> records,
                std::span<const JointRecord> joints);

  // From a snapshot that is valid; and back, but for what is held.
  WorldRegistry(const WorldSnapshot& world, const WorldCatalogue& catalogue);
  WorldCatalogue catalogue() const;
  // Of it, the ids that come next.
  WorldCatalogue next_ids() const;
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

  // Adds a new body, which is there from tick `at` on. Errors as validate() and record_of(), ALREADY_EXISTS
  // for a name in use, RESOURCE_EXHAUSTED if ids, bodies or shapes are used up, or all shapes would have more
  // than `shape_bytes_max` bytes; an error changes nothing.
  struct Spawned {
    BodyRecord record;
    std::optional<v1::NumberedShape> new_shape;  // if the world did not have it yet
  };
  absl::StatusOr<Spawned> spawn(const v1::SpawnRequest& request, Tick at,
                                std::size_t shape_bytes_max = std::numeric_limits<std::size_t>::max());

  const JointRegistry& joints() const { return joints_; }

  // Adds a new joint. Errors as validate() and joint_properties_of(), NOT_FOUND for a body that does not
  // exist, ALREADY_EXISTS for a name in use, RESOURCE_EXHAUSTED beyond kJointsMax; an error changes nothing.
  absl::StatusOr<JointRecord> add_joint(const v1::AddJointRequest& request);

  // The command that adds a joint to the world, which has just been added here.
  AddJoint addition_of(const JointRecord& joint) const;

  // The command that removes a body that exists, with its shape where no other body has it.
  RemoveBody removal_of(BodyId id) const;

  // Applies the effect of a checked command, which servers carry out at tick `at`, on this record.
  void apply(const Command& command, Tick at);

  // Ascending by id, at most `limit` (0: kFoundBodiesDefault); a prefix that is empty lists all.
  v1::ListJointsReply list_joints(const v1::ListJointsRequest& request) const;

  // Ascending by name, otherwise likewise.
  v1::ListFramesReply list_frames(const v1::ListFramesRequest& request) const;

  // Ascending by id, at most `limit` (0: kFoundBodiesDefault); a prefix that is empty finds all. Ids that no
  // body has are skipped.
  v1::FindBodiesReply find_bodies(const v1::FindBodiesRequest& request) const;

 private:
  void remove(BodyId id, Tick at);
  absl::StatusOr<BodyId> body_of_joint(const char* side, const v1::BodyRef& reference,
                                       BodyId otherwise) const;
  absl::Status check_room() const;
  std::string name_for(BodyId id) const;
  absl::StatusOr<BodyRecord> checked_record(const BodyDescription& body, const Shape* shape) const;
  absl::Status room_for_shape(const std::string& title, std::size_t bytes, std::size_t bytes_max) const;
  void insert(BodyId id, std::string name, const BodyProperties& properties);

  WorldSettings settings_;
  ShapeTable shapes_;
  std::map<BodyId, Entry> bodies_;  // node addresses are stable: names_ refers to them
  absl::btree_map<std::string_view, BodyId> names_;
  BodyId next_id_{1};
  JointRegistry joints_;
  FrameRegistry frames_;
  std::uint64_t changes_ = 0;
};

}  // namespace tessera
