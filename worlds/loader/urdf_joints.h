// Nothing of a robot is lost when libsdformat makes a model of it.
#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <string>
#include <vector>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// URDF robots name the world `world`, and libsdformat takes from such a link nothing but its joints. One that
// has a collision gets the suffix "_link", and is fixed to the world.
void settle_urdf_world(xml::Element& robot, Notices& notices);

// A link on a fixed joint becomes a part of the link that it is fixed to, directly or through others. If it
// has no mass (no <inertial>), nor have those that are fixed to it, libsdformat stops there, and leaves out
// the joints of its children, and all that hangs on them: these become joints of the link that it is fixed
// to, at the same place. INVALID_ARGUMENT, with file and line, for an <origin> that is no pose.
absl::Status lift_joints(xml::Element& robot);

// What a robot has, to be found again in its model.
class UrdfCensus {
 public:
  explicit UrdfCensus(const xml::Element& robot);

  // INVALID_ARGUMENT, with what is missing, unless `model`, a <model> of SDF, has each link, as a link or
  // frame, each joint that moves or holds at the world, and each collision.
  absl::Status check(const xml::Element& model) const;

 private:
  const xml::Element& robot_;
  std::vector<std::string> links_;
  std::vector<std::string> joints_;
  std::size_t collisions_ = 0;
};

}  // namespace tessera
