#include "ros/node.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include <utility>

#include "daemon/log.h"
#include "transport/dds_domain.h"

namespace tessera::ros {
namespace {

// A ROS node would wait for slow readers forever; we continue with newer messages.
constexpr dds_duration_t kWriteWait = DDS_MSECS(100);

dds_qos_t* qos_of(const Profile& profile) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, kWriteWait);
  dds_qset_durability(qos, profile.is_kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, profile.depth);
  const dds_data_representation_id_t encoding = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &encoding);
  return qos;
}

std::string dds_name(absl::string_view topic) { return absl::StrCat("rt", topic); }

}  // namespace

absl::StatusOr<std::unique_ptr<Node>> Node::open(std::uint32_t domain) {
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  if (participant < 0) return dds_error(participant, absl::StrCat("cannot open DDS domain ", domain));
  return std::unique_ptr<Node>(new Node(participant));
}

Node::~Node() { dds_delete(participant_); }

absl::StatusOr<dds_entity_t> Node::writer(const dds_topic_descriptor_t& type, const std::string& topic,
                                          const Profile& profile) {
  dds_qos_t* const qos = qos_of(profile);
  const absl::Cleanup delete_qos = [qos] { dds_delete_qos(qos); };
  dds_qset_writer_data_lifecycle(qos, /*autodispose=*/false);
  const dds_entity_t entity =
      dds_create_topic(participant_, &type, dds_name(topic).c_str(), nullptr, nullptr);
  if (entity < 0) return dds_error(entity, absl::StrCat("cannot create the topic ", topic));
  const dds_entity_t writer = dds_create_writer(participant_, entity, qos, nullptr);
  if (writer < 0) return dds_error(writer, absl::StrCat("cannot publish ", topic));
  return writer;
}

absl::StatusOr<dds_entity_t> Node::reader(const dds_topic_descriptor_t& type, const std::string& topic,
                                          std::function<void()> on_data) {
  dds_qos_t* const qos = qos_of({});
  const absl::Cleanup delete_qos = [qos] { dds_delete_qos(qos); };
  const dds_entity_t entity =
      dds_create_topic(participant_, &type, dds_name(topic).c_str(), nullptr, nullptr);
  if (entity < 0) return dds_error(entity, absl::StrCat("cannot create the topic ", topic));
  const std::function<void()>& call = listeners_.emplace_back(std::move(on_data));
  dds_listener_t* const listener = dds_create_listener(const_cast<std::function<void()>*>(&call));
  const absl::Cleanup delete_listener = [listener] { dds_delete_listener(listener); };
  dds_lset_data_available(listener, [](dds_entity_t, void* argument) {
    (*static_cast<const std::function<void()>*>(argument))();
  });
  const dds_entity_t reader = dds_create_reader(participant_, entity, qos, listener);
  if (reader < 0) return dds_error(reader, absl::StrCat("cannot subscribe to ", topic));
  return reader;
}

void warn(const absl::Status& status) {
  if (!status.ok()) log_warning(status.message());
}

absl::Status write(dds_entity_t writer, const void* message, absl::string_view topic) {
  const dds_return_t rc = dds_write(writer, message);
  return rc < 0 ? dds_error(rc, absl::StrCat("cannot publish ", topic)) : absl::OkStatus();
}

}  // namespace tessera::ros
