// Writers of /clock, /tf and /tf_static, compatible with ROS 2 nodes over Cyclone DDS.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "ros/transforms.h"

namespace tessera::ros {

// For one thread at a time. Writing fails with DEADLINE_EXCEEDED if readers are so far behind that the queue
// is full.
class Publisher {
 public:
  // `domain` is what ROS calls its domain id. As in a node, Cyclone DDS takes its network from
  // CYCLONEDDS_URI, or chooses itself. INTERNAL if it finds no usable network.
  static absl::StatusOr<std::unique_ptr<Publisher>> open(std::uint32_t domain);
  ~Publisher();

  absl::Status publish_clock(const Time& time);
  absl::Status publish_transforms(const std::vector<TransformStamped>& transforms);
  // The last message is kept for late joiners, so it must have all static transforms.
  absl::Status publish_static_transforms(const std::vector<TransformStamped>& transforms);

 private:
  explicit Publisher(std::int32_t participant) : participant_(participant) {}

  std::int32_t participant_;
  std::int32_t clock_ = 0;
  std::int32_t transforms_ = 0;
  std::int32_t static_transforms_ = 0;
};

}  // namespace tessera::ros
