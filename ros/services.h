// The services of ROS's package simulation_interfaces: entities, and time.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ros/entities.h"
#include "ros/node.h"
#include "simulation_interfaces.h"
#include "tessera/client.h"

namespace tessera::ros {

struct ServiceOptions {
  std::string frame = "tessera";      // in which poses are given
  std::optional<SectorIndex> sector;  // whose centre it is; none: the world's origin
  std::filesystem::path world;        // loaded again by a reset; empty: there is no reset
};

// Serves from open() on, on a thread of its own: one request after the other.
class Services {
 public:
  // `client` and `node` must live longer.
  static absl::StatusOr<std::unique_ptr<Services>> open(Client& client, Node& node,
                                                        const ServiceOptions& options);
  ~Services();

 private:
  // What a reply has until it is written.
  class Texts;
  using Result = simulation_interfaces_msg_dds__Result_;

  Services(Client& client, const ServiceOptions& options);
  absl::Status add_entities(Node& node);
  absl::Status add_time(Node& node);
  // A service whose requests `handle` answers: handle(request, reply, texts).
  template <typename Request, typename Reply, typename Handle>
  absl::Status add(Node& node, const char* name, const dds_topic_descriptor_t& request,
                   const dds_topic_descriptor_t& reply, Handle handle);
  void run();

  static Result result_of(const absl::Status& status, Texts& texts);
  simulation_interfaces_msg_dds__EntityState_ message_of(const EntityState& state, Texts& texts) const;
  absl::Status set_state(const simulation_interfaces_srv_dds__SetEntityState_Request_& request);
  absl::StatusOr<std::string> spawn(const simulation_interfaces_srv_dds__SpawnEntity_Request_& request,
                                    Result& result, Texts& texts);
  void change_state(std::uint8_t wanted, Result& result, Texts& texts);
  absl::Status step(std::uint64_t steps);
  void reset(std::uint8_t scope, Result& result, Texts& texts);
  // Of a header: whether poses are in the frame that there is.
  absl::Status check_frame(const char* frame) const;

  Client& client_;
  const ServiceOptions options_;
  Entities entities_;
  std::vector<ServiceEnds> ends_;
  std::vector<std::function<void()>> services_;  // each answers the requests that have come

  std::mutex mutex_;
  std::condition_variable changed_;
  bool has_requests_ = false;
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace tessera::ros
