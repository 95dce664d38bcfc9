// What a seam policy decides: a partition has the rules of its world, and whoever asks them need not know
// which policy it is. Here are those of the policy island; those of the policy clone are in clone_rules.h.
#pragma once

#include <Eigen/Geometry>

#include "lpss/grid/offset_set.h"
#include "lpss/model/body.h"
#include "lpss/model/seam_policy.h"

namespace tessera {

struct Clone;
struct ContactPair;
struct Partition;
struct Sector;

class SeamRules {
 public:
  virtual ~SeamRules() = default;

  // Whether each sector solves its bodies and clones by itself, and finds all contacts of both. If so,
  // nothing is solved across borders. If not, a contact is found in one sector, and a clone stands for its
  // original.
  virtual bool clones_are_solved() const { return false; }

  // The sectors, relative to its home, that need a replica of a body at `velocity` (m/s), with a surge (m,
  // SectorWorld::surge()), whose box sweeps `swept` (m, relative to the home's centre).
  virtual OffsetSet sectors_to_tell(const Partition& partition, const Eigen::AlignedBox3d& swept,
                                    const Eigen::Vector3d& velocity, double surge, Motion motion) const;

  // Attends to bodies that are inside their sector, where others may have to hear of these, too.
  virtual void attend_inside(Sector&) const {}

  // Adds to the sectors that need replicas (HomeBody::wanted_in) those that need them on account of others.
  virtual void extend_search(Partition&) const {}

  // Whether the sector needs the body's clone even where nothing that lives there is about to touch it.
  virtual bool needs_clone(const Partition&, BodyId, const Sector&) const { return false; }

  // Has a clone fall like its original, if it is solved.
  virtual void pull_clone(const Partition&, const Clone&) const {}

  // Whether this sector, which has found the contact, tells clients of it.
  virtual bool reports(const Partition&, const Sector&, const ContactPair&) const { return true; }
};

// They last as long as the process.
const SeamRules& seam_rules(SeamPolicy policy);

}  // namespace tessera
