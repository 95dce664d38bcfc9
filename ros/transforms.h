// Bodies as ROS 2 transforms: frames that are children of one frame, the centre of a sector.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/node_hash_map.h>
#include <absl/strings/string_view.h>

#include <string>
#include <utility>
#include <vector>

#include "lpss/model/frame_motion.h"
#include "lpss/model/world_description.h"
#include "ros_messages.h"
#include "tessera/client.h"
#include "tessera/stream.h"

namespace tessera::ros {

using Time = builtin_interfaces_msg_dds__Time_;
using TransformStamped = geometry_msgs_msg_dds__TransformStamped_;

// Simulated time at the end of a tick of `time_step` seconds, to the nearest nanosecond. ROS counts seconds
// in 32 bits: the time stops at 2^31 s.
Time time_at(Tick tick, double time_step);

// "tower/box" for the body "tower::box"; "box" where the model "tower" is the `root`.
std::string frame_name(absl::string_view body_name, absl::string_view root = "");

// The transforms of frames of one world. They refer to names in this object, and are valid while it lives.
class Transforms {
 public:
  // `parent` is the centre of `sector`, with the world's axes. Names are as frame_name() has them.
  Transforms(std::string parent, const SectorIndex& sector, const WorldSettings& settings,
             std::string root = "");

  void name(BodyId id, absl::string_view body_name);
  bool has_name(BodyId id) const { return names_.contains(id); }

  // Of frames that are fixed to bodies: children of the frames of these. Those of the call before are gone.
  std::vector<TransformStamped> fixed(const std::vector<FoundFrame>& frames, Tick tick);

  // The transforms of all bodies with a name.
  std::vector<TransformStamped> all(const BodyFrame& frame) const;

  // The transforms of bodies that have moved, appeared or been named since the previous call.
  std::vector<TransformStamped> changed(const BodyFrame& frame);

 private:
  using Poses = absl::flat_hash_map<BodyId, WorldPose>;

  // Of bodies of frames that move, where these are at that tick.
  SeenCarriers carriers_in(const BodyFrame& frame) const;
  WorldPose pose_of(const BodySample& body, Tick tick, const SeenCarriers& carriers) const;
  TransformStamped transform(BodyId body, const WorldPose& pose, const Time& stamp) const;

  std::string parent_;
  std::string root_;
  SectorIndex sector_;
  WorldSettings settings_;
  absl::node_hash_map<BodyId, std::string> names_;
  Poses last_;
  std::vector<std::pair<std::string, std::string>> fixed_names_;  // of frames: parents and children
};

}  // namespace tessera::ros
