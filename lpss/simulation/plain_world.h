// The baseline without Tessera: one Bullet world with every body at its absolute coordinates.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "lpss/engine/whole_world.h"
#include "lpss/model/world_description.h"
#include "lpss/observe/world_hash.h"

namespace tessera {

// Coordinates are metres from the anchor's centre, rounded to what the engine computes with, whatever
// precision the world asks for. The same bodies as in Tessera, and the smaller friction of two; all else is
// Bullet's own, with its defaults, but for the settings that lpss/bullet/discrete_world.h names. Joints are
// Bullet's constraints (lpss/bullet/bullet_joints.h), without those that it does not have: screws, axes that
// follow others, and what hangs on a kinematic body. Kinematic bodies stay where they are. Not for several
// threads at a time.
class PlainWorld {
 public:
  // Errors as validate() and load_engine(); INVALID_ARGUMENT for a world with ground.
  static absl::StatusOr<std::unique_ptr<PlainWorld>> create(const WorldDescription& world,
                                                            Precision precision);

  void step();

  // Of a joint, until it is set again; nothing for one that Bullet does not have.
  void set_drives(JointId id, const JointDrives& drives);

  // Calls `visit` for each body that can move, in ascending order of ids. Homes are the anchor, positions
  // relative to its centre: of any size, or no numbers at all.
  void for_each_body(const std::function<void(const BodyRecord&)>& visit) const;

  // Of those bodies. As they are all at home with the anchor, not to be compared with that of sectors.
  WorldHash hash() const;

 private:
  struct Body {
    BodyRecord record;  // as it started
    BodySlot slot = 0;
  };

  struct Joint {
    JointRecord record;
    BodySlot child = kNoSlot;
    BodySlot parent = kNoSlot;
    Pose in_parent;
  };

  PlainWorld() = default;
  void add_joint(const JointRecord& record, const std::vector<BodySlot>& slots);
  void set_gravity();

  WorldSettings settings_;
  SectorIndex anchor_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<WholeWorld> world_;
  std::vector<Body> bodies_;   // that can move, ascending by id
  std::vector<Joint> joints_;  // ascending by id
};

}  // namespace tessera
