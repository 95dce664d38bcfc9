// Publishes a cluster to ROS while it exists, including worlds that are loaded later.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client_sdk/live/body_catalogue.h"
#include "client_sdk/live/cluster_monitor.h"
#include "client_sdk/live/latest_frame.h"
#include "ros/node.h"
#include "ros/publisher.h"
#include "ros/robots.h"
#include "ros/transforms.h"
#include "tessera/client.h"

namespace tessera::ros {

// What /tf tells.
enum class Told {
  kBodies,  // all bodies, in one frame
  kWays,    // where robots are by their wheels, for a robot_state_publisher that tells the rest
  kNothing,
};

struct FeedOptions {
  std::string frame = "tessera";      // the parent of all other frames
  std::optional<SectorIndex> sector;  // whose centre it is; none: the world's origin
  double reach = 100;                 // m; bodies within this distance of the centre along each axis
  std::vector<std::string> bodies;    // if not empty: these instead, wherever they are
  double rate = 60;                   // publications per second of wall time, at most
  RobotOptions robots;
  Told transforms = Told::kBodies;
};

class Feed {
 public:
  // `node` must live longer.
  Feed(Client& client, Node& node, Publisher publisher, const FeedOptions& options);
  ~Feed();

 private:
  using Clock = std::chrono::steady_clock;

  void run();

  // On the thread of run(), which owns the data.
  void hear(const live::ClusterReport& report);
  void enter(const live::ClusterReport& report);  // a new world
  absl::Status look_up(Tick tick);                // finds the chosen bodies; publishes the static ones
  absl::StatusOr<std::vector<TransformStamped>> look_up_frames(Tick tick);
  bool is_chosen(const std::string& name, const WorldPosition& position) const;
  void watch(std::uint32_t every_ticks);
  void watch_robots();
  void notify();
  void publish(Clock::time_point now);
  void introduce(const BodyFrame& frame);

  Client& client_;
  Publisher publisher_;
  const FeedOptions options_;
  const Clock::duration period_;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool closing_ = false;
  std::shared_ptr<const live::ClusterReport> news_;

  // Owned by the thread of run().
  std::string obstacle_;  // the last one reported
  std::uint64_t world_ = 0;
  SectorIndex sector_;
  double sector_size_ = 0;
  double time_step_ = 0;
  live::BodyCatalogue catalogue_;
  std::optional<std::uint64_t> counted_bodies_;  // of the world, at the last look_up()
  std::vector<BodyId> ids_;                      // to watch; empty: all within reach
  BodyFilter filter_;                            // of the watched stream
  std::optional<Transforms> transforms_;
  std::optional<BodyFrame> frame_;  // the newest
  Clock::time_point next_publication_{};
  Clock::time_point next_repetition_{};
  Robots robots_;
  std::optional<live::LatestFrame<BodyFrame>> bodies_;
  std::optional<live::LatestFrame<ProgramFrame>> programs_;  // of measuring_
  std::optional<live::LatestFrame<JointFrame>> joints_;      // of watched_joints_
  std::vector<BodyId> measuring_;
  std::vector<JointId> watched_joints_;

  live::ClusterMonitor monitor_;
  std::thread thread_;
};

}  // namespace tessera::ros
