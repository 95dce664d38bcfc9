#include "ros/publisher.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include "dds/dds.h"
#include "transport/dds_domain.h"

namespace tessera::ros {
namespace {

// A ROS node would wait for slow readers forever; we continue with newer messages.
constexpr dds_duration_t kWriteWait = DDS_MSECS(100);

// A QoS profile, in ROS terms, of a reliable topic.
struct Profile {
  std::int32_t depth;
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
};

constexpr Profile kClock{
    .depth = 10};  // ROS's default; it also suits best-effort readers, such as those of rclcpp
constexpr Profile kTransforms{.depth = 100};
constexpr Profile kStaticTransforms{.depth = 1, .durability = DDS_DURABILITY_TRANSIENT_LOCAL};

absl::StatusOr<dds_entity_t> create_writer(dds_entity_t participant, const dds_topic_descriptor_t& type,
                                           const char* name, const Profile& profile) {
  dds_qos_t* qos = dds_create_qos();
  const absl::Cleanup delete_qos = [qos] { dds_delete_qos(qos); };
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, kWriteWait);
  dds_qset_durability(qos, profile.durability);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, profile.depth);
  dds_qset_writer_data_lifecycle(qos, /*autodispose=*/false);
  const dds_data_representation_id_t encoding = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &encoding);
  const dds_entity_t topic = dds_create_topic(participant, &type, name, nullptr, nullptr);
  if (topic < 0) return dds_error(topic, absl::StrCat("cannot create the topic ", name));
  const dds_entity_t writer = dds_create_writer(participant, topic, qos, nullptr);
  if (writer < 0) return dds_error(writer, absl::StrCat("cannot publish ", name));
  return writer;
}

absl::Status write(dds_entity_t writer, const void* message, const char* name) {
  const dds_return_t rc = dds_write(writer, message);
  return rc < 0 ? dds_error(rc, absl::StrCat("cannot publish ", name)) : absl::OkStatus();
}

absl::Status write(dds_entity_t writer, const std::vector<TransformStamped>& transforms, const char* name) {
  const auto count = static_cast<std::uint32_t>(transforms.size());
  tf2_msgs_msg_dds__TFMessage_ message{};
  // DDS only reads what it writes.
  message.transforms = {count, count, const_cast<TransformStamped*>(transforms.data()), /*_release=*/false};
  return write(writer, &message, name);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Publisher>> Publisher::open(std::uint32_t domain) {
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  if (participant < 0) return dds_error(participant, absl::StrCat("cannot open DDS domain ", domain));
  std::unique_ptr<Publisher> publisher(new Publisher(participant));
  const auto clock = create_writer(participant, rosgraph_msgs_msg_dds__Clock__desc, "rt/clock", kClock);
  const auto transforms = create_writer(participant, tf2_msgs_msg_dds__TFMessage__desc, "rt/tf", kTransforms);
  const auto static_transforms =
      create_writer(participant, tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", kStaticTransforms);
  for (const auto* writer : {&clock, &transforms, &static_transforms}) {
    if (!writer->ok()) return writer->status();
  }
  publisher->clock_ = *clock;
  publisher->transforms_ = *transforms;
  publisher->static_transforms_ = *static_transforms;
  return publisher;
}

Publisher::~Publisher() { dds_delete(participant_); }

absl::Status Publisher::publish_clock(const Time& time) {
  const rosgraph_msgs_msg_dds__Clock_ message{time};
  return write(clock_, &message, "/clock");
}

absl::Status Publisher::publish_transforms(const std::vector<TransformStamped>& transforms) {
  return write(transforms_, transforms, "/tf");
}

absl::Status Publisher::publish_static_transforms(const std::vector<TransformStamped>& transforms) {
  return write(static_transforms_, transforms, "/tf_static");
}

}  // namespace tessera::ros
