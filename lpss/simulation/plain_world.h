// The baseline without Tessera: one Bullet world with every body at its absolute coordinates.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/model/world_description.h"
#include "lpss/observe/world_hash.h"

namespace tessera {

// One engine world whose "sector" is the whole world: coordinates are metres from the anchor's centre,
// rounded to what the engine computes with, whatever precision the world asks for. The same bodies, settings
// and sleeping as in Tessera, but no sectors, and Bullet's own solver without substeps. Joints are Bullet's
// own constraints (lpss/bullet/bullet_joints.h), without those that it does not have: screws, axes that
// follow others, and what hangs on a kinematic body. Not for several threads at a time.
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
    TaskJoint task;  // points into `record` and the world
  };

  PlainWorld() = default;
  void add_joints(const std::vector<JointRecord>& joints, const std::vector<BodyRecord>& records);
  void set_gravity();
  void settle_islands(SolveTask& task);

  WorldSettings settings_;
  SectorIndex anchor_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<SectorWorld> world_;
  std::unique_ptr<IslandSolver> solver_;
  std::vector<Body> bodies_;
  absl::flat_hash_map<BodyId, std::size_t> places_;  // of dynamic bodies in bodies_
  std::vector<Joint> joints_;                        // ascending by id
};

}  // namespace tessera
