#include "ros/publisher.h"

#include <cstdint>

namespace tessera::ros {
namespace {

constexpr char kClock[] = "/clock";
constexpr char kTransforms[] = "/tf";
constexpr char kStaticTransforms[] = "/tf_static";

absl::Status write_all(dds_entity_t writer, const std::vector<TransformStamped>& transforms,
                       const char* topic) {
  const auto count = static_cast<std::uint32_t>(transforms.size());
  tf2_msgs_msg_dds__TFMessage_ message{};
  // DDS only reads what it writes.
  message.transforms = {count, count, const_cast<TransformStamped*>(transforms.data()), /*_release=*/false};
  return write(writer, &message, topic);
}

}  // namespace

absl::StatusOr<Publisher> Publisher::open(Node& node) {
  // The clock also serves best-effort readers, such as those of rclcpp.
  const auto clock = node.writer(rosgraph_msgs_msg_dds__Clock__desc, kClock);
  const auto transforms = node.writer(tf2_msgs_msg_dds__TFMessage__desc, kTransforms, {.depth = 100});
  const auto static_transforms =
      node.writer(tf2_msgs_msg_dds__TFMessage__desc, kStaticTransforms, {.depth = 1, .is_kept = true});
  for (const auto* writer : {&clock, &transforms, &static_transforms}) {
    if (!writer->ok()) return writer->status();
  }
  Publisher publisher;
  publisher.clock_ = *clock;
  publisher.transforms_ = *transforms;
  publisher.static_transforms_ = *static_transforms;
  return publisher;
}

absl::Status Publisher::publish_clock(const Time& time) {
  const rosgraph_msgs_msg_dds__Clock_ message{time};
  return write(clock_, &message, kClock);
}

absl::Status Publisher::publish_transforms(const std::vector<TransformStamped>& transforms) {
  return write_all(transforms_, transforms, kTransforms);
}

absl::Status Publisher::publish_static_transforms(const std::vector<TransformStamped>& transforms) {
  return write_all(static_transforms_, transforms, kStaticTransforms);
}

}  // namespace tessera::ros
