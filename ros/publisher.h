// Writers of /clock, /tf and /tf_static, compatible with ROS 2 nodes over Cyclone DDS.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <vector>

#include "ros/bridge.h"
#include "ros/node.h"
#include "ros/transforms.h"

namespace tessera::ros {

// For one thread at a time. Writing fails with DEADLINE_EXCEEDED if readers are so far behind that the queue
// is full.
class Publisher {
 public:
  // `node` must live longer. `bridge`: which of the topics there are, and under which names; null: all, under
  // their own. What is published on others is lost. With /tf comes /tf_static.
  static absl::StatusOr<Publisher> open(Node& node, Bridge* bridge = nullptr);

  absl::Status publish_clock(const Time& time);
  absl::Status publish_transforms(const std::vector<TransformStamped>& transforms);
  // The last message is kept for late joiners, so it must have all static transforms.
  absl::Status publish_static_transforms(const std::vector<TransformStamped>& transforms);

 private:
  Publisher() = default;

  // 0: it is not there.
  dds_entity_t clock_ = 0;
  dds_entity_t transforms_ = 0;
  dds_entity_t static_transforms_ = 0;
};

}  // namespace tessera::ros
