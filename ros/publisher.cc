#include "ros/publisher.h"

#include <cstdint>

namespace tessera::ros {
namespace {

constexpr char kClock[] = "/clock";
constexpr char kTransforms[] = "/tf";
constexpr char kStaticTransforms[] = "/tf_static";

absl::Status write_all(dds_entity_t writer, const std::vector<TransformStamped>& transforms,
                       const char* topic) {
  if (writer == 0) return absl::OkStatus();
  const auto count = static_cast<std::uint32_t>(transforms.size());
  tf2_msgs_msg_dds__TFMessage_ message{};
  // DDS only reads what it writes.
  message.transforms = {count, count, const_cast<TransformStamped*>(transforms.data()), /*_release=*/false};
  return write(writer, &message, topic);
}

}  // namespace

absl::StatusOr<Publisher> Publisher::open(Node& node, Bridge* bridge) {
  const auto open_writer = [&](const dds_topic_descriptor_t& type, OwnTopic topic,
                               const Profile& profile) -> absl::StatusOr<dds_entity_t> {
    if (bridge == nullptr) return node.writer(type, topic.topic, profile);
    topic.type = ros_type(type.m_typename);
    if (const BridgeEntry* const entry = bridge->find(topic, {}))
      return node.writer(type, entry->ros_topic, profile);
    if (topic.topic == kStaticTransforms && bridge->has_ros_topic(kTransforms))
      return node.writer(type, kStaticTransforms, profile);
    return 0;
  };
  // The clock also serves best-effort readers, such as those of rclcpp.
  const auto clock =
      open_writer(rosgraph_msgs_msg_dds__Clock__desc, {.topic = kClock, .is_only_one = true}, {});
  const auto transforms = open_writer(
      tf2_msgs_msg_dds__TFMessage__desc,
      {.topic = kTransforms, .names = {"tf", "pose", "pose/info", "dynamic_pose/info"}}, {.depth = 100});
  const auto static_transforms = open_writer(
      tf2_msgs_msg_dds__TFMessage__desc, {.topic = kStaticTransforms, .names = {"tf_static", "pose_static"}},
      {.depth = 1, .is_kept = true});
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
  if (clock_ == 0) return absl::OkStatus();
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
