// Writers of /clock, /tf and /tf_static, as nodes of ROS 2 have them over Cyclone DDS.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "ros/transforms.h"

namespace tessera::ros {

// One thread at a time. Writing fails with DEADLINE_EXCEEDED where readers are so far behind that there is no
// room for more.
class Publisher {
 public:
  // `domain` is what ROS calls its domain id. As in a node, Cyclone DDS takes its network from
  // CYCLONEDDS_URI, or looks for itself. INTERNAL where it finds none that it can use.
  static absl::StatusOr<std::unique_ptr<Publisher>> open(std::uint32_t domain);
  ~Publisher();

  absl::Status publish_clock(const Time& time);
  absl::Status publish_transforms(const std::vector<TransformStamped>& transforms);
  // The newest are kept for readers that come later: they must be all there are.
  absl::Status publish_static_transforms(const std::vector<TransformStamped>& transforms);

 private:
  explicit Publisher(std::int32_t participant) : participant_(participant) {}

  std::int32_t participant_;
  std::int32_t clock_ = 0;
  std::int32_t transforms_ = 0;
  std::int32_t static_transforms_ = 0;
};

}  // namespace tessera::ros
