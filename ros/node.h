// A participant of a ROS 2 graph: its writers and readers are those that Cyclone DDS has for ROS's nodes.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "dds/dds.h"

namespace tessera::ros {

// A QoS profile, in ROS's terms, of a reliable topic.
struct Profile {
  std::int32_t depth = 10;  // ROS's default
  bool is_kept = false;     // for readers that come later: transient local
};

// For one thread at a time.
class Node {
 public:
  // `domain` is what ROS calls its domain id. As in a node, Cyclone DDS takes its network from
  // CYCLONEDDS_URI, or chooses itself. INTERNAL if it finds no usable network.
  static absl::StatusOr<std::unique_ptr<Node>> open(std::uint32_t domain);
  ~Node();

  // Topics are named as in ROS: "/tf". Readers and writers live as long as the node.
  absl::StatusOr<dds_entity_t> writer(const dds_topic_descriptor_t& type, const std::string& topic,
                                      const Profile& profile = {});
  // `on_data` is called, on a thread of DDS, when there is something to take.
  absl::StatusOr<dds_entity_t> reader(const dds_topic_descriptor_t& type, const std::string& topic,
                                      std::function<void()> on_data);

 private:
  explicit Node(dds_entity_t participant) : participant_(participant) {}

  dds_entity_t participant_;
  std::deque<std::function<void()>> listeners_;
};

// A text of a message. DDS only reads what it writes.
inline char* text(const std::string& string) { return const_cast<char*>(string.c_str()); }

// In the log.
void warn(const absl::Status& status);

// DEADLINE_EXCEEDED if readers are so far behind that the queue is full.
absl::Status write(dds_entity_t writer, const void* message, absl::string_view topic);

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
