// A participant of a ROS 2 graph: its writers and readers are those that Cyclone DDS has for ROS's nodes.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "dds/dds.h"

namespace tessera::ros {

// A QoS profile, in ROS's terms, of a reliable topic.
struct Profile {
  std::int32_t depth = 10;  // ROS's default
  bool is_kept = false;     // for readers that come later: transient local
};

// The two ends of a service.
struct ServiceEnds {
  dds_entity_t requests = 0;
  dds_entity_t replies = 0;
};

// "/robot/scan" by another name, "/scan".
using Remaps = std::map<std::string, std::string>;
// "/robot/scan:=/scan". INVALID_ARGUMENT for names that ROS cannot have.
absl::StatusOr<std::pair<std::string, std::string>> parse_remap(const std::string& text);

// Thread-safe.
class Node {
 public:
  // `domain` is what ROS calls its domain id. As in a node, Cyclone DDS takes its network from
  // CYCLONEDDS_URI, or chooses itself. INTERNAL if it finds no usable network.
  // `remaps`: other names of topics and services.
  static absl::StatusOr<std::unique_ptr<Node>> open(std::uint32_t domain, Remaps remaps = {});
  ~Node();

  // Topics are named as in ROS: "/tf". Readers and writers live as long as the node.
  absl::StatusOr<dds_entity_t> writer(const dds_topic_descriptor_t& type, const std::string& topic,
                                      const Profile& profile = {});
  // `on_data` is called, on a thread of DDS, when there is something to take.
  absl::StatusOr<dds_entity_t> reader(const dds_topic_descriptor_t& type, const std::string& topic,
                                      std::function<void()> on_data, const Profile& profile = {});
  // A service as rmw_cyclonedds has it, named as in ROS: "/spawn_entity". Both types begin with the client
  // and the number of the request.
  absl::StatusOr<ServiceEnds> service(const dds_topic_descriptor_t& request,
                                      const dds_topic_descriptor_t& reply, const std::string& name,
                                      std::function<void()> on_request);

 private:
  Node(dds_entity_t participant, Remaps remaps) : participant_(participant), remaps_(std::move(remaps)) {}

  // As DDS names it: with `prefix` before what ROS calls it.
  std::string dds_name(absl::string_view prefix, const std::string& name,
                       absl::string_view suffix = "") const;
  absl::StatusOr<dds_entity_t> write_to(const dds_topic_descriptor_t& type, const std::string& dds_name,
                                        const dds_qos_t* qos);
  absl::StatusOr<dds_entity_t> read_from(const dds_topic_descriptor_t& type, const std::string& dds_name,
                                         const dds_qos_t* qos, std::function<void()> on_data);

  dds_entity_t participant_;
  const Remaps remaps_;
  std::mutex mutex_;
  std::deque<std::function<void()>> listeners_;
};

// A text of a message. DDS only reads what it writes.
inline char* text(const std::string& string) { return const_cast<char*>(string.c_str()); }

// In the log.
void warn(const absl::Status& status);

// DEADLINE_EXCEEDED if readers are so far behind that the queue is full.
absl::Status write(dds_entity_t writer, const void* message, absl::string_view topic);

// Whether somebody reads what a writer writes.
bool has_reader(dds_entity_t writer);

// Waits for somebody who reads what a writer writes, for so long at most.
void await_reader(dds_entity_t writer, dds_duration_t most);

// Calls take(const Message&) with all that has come.
template <typename Message, typename Take>
void take_all(dds_entity_t reader, const Take& take) {
  for (;;) {
    void* sample = nullptr;
    dds_sample_info_t info;
    if (dds_take(reader, &sample, &info, 1, 1) != 1) return;
    if (info.valid_data) take(*static_cast<const Message*>(sample));
    dds_return_loan(reader, &sample, 1);
  }
}

}  // namespace tessera::ros
