// Trajectories that the joints of a model follow: ROS's topic `joint_trajectory`, and its action
// `follow_joint_trajectory`.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/joint_path.h"
#include "ros/node.h"
#include "ros/transforms.h"

namespace tessera::ros {

// For one thread, but for `on_data`. The model follows one trajectory at a time: a new one ends the one
// before.
class Follower {
 public:
  // Where a joint is, rad or m; nothing for one that the model does not have.
  using Where = std::function<std::optional<double>(const std::string& joint)>;

  // `above`: of the model's topics, "/robot/". `topic` is that of trajectories. `on_data` is called, on a
  // thread of DDS, when something has come. `node` must live longer.
  static absl::StatusOr<std::unique_ptr<Follower>> open(Node& node, const std::string& above,
                                                        const std::string& topic,
                                                        std::function<void()> on_data);
  ~Follower();
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  // Answers what has come.
  void take(Tick now, double time_step, const Where& where);
  // Where joints should be at the end of the next tick; none: they follow nothing.
  std::vector<std::pair<std::string, double>> next(Tick now, double time_step, const Where& where);
  // Its model has gone: nothing is followed.
  void forget();

 private:
  using Id = std::array<std::uint8_t, 16>;
  using Trajectory = trajectory_msgs_msg_dds__JointTrajectory_;
  struct Goal {
    std::optional<Id> id;  // none: it came by the topic
    JointPath path;
    Tick start = 0;
    Time stamp{};
    std::vector<std::pair<std::string, double>> tolerances;  // of the end: rad or m
    double late = 0;                                         // s, that it may take longer
    std::int8_t status = 0;
    std::int32_t error = 0;
    std::string why;
  };
  struct Ends {
    dds_entity_t topic = 0;
    dds_entity_t status = 0;
    dds_entity_t feedback = 0;
    ServiceEnds send;
    ServiceEnds cancel;
    ServiceEnds result;
  };

  explicit Follower(const Ends& ends) : ends_(ends) {}
  static absl::StatusOr<JointPath> path_of(const Trajectory& message, const Where& where);
  void take_goals(Tick now, const Time& stamp, const Where& where);
  void take_cancellations();
  void take_result_requests();
  void start(Goal goal);
  void end(std::int8_t status, std::int32_t error, std::string why);
  const Goal* find(const Id& id) const;
  bool answer(const Id& id, std::uint64_t client, std::int64_t number);  // false: it is on its way
  void publish_status();
  // Of a goal, so long after its beginning, s.
  void publish_feedback(Tick now, double time_step, double elapsed, const Where& where) const;

  Ends ends_;
  std::optional<Goal> active_;
  std::deque<Goal> ended_;  // the last ones
  struct Waiting {
    Id id;
    std::uint64_t client = 0;
    std::int64_t number = 0;
  };
  std::deque<Waiting> waiting_;  // for results
};

}  // namespace tessera::ros
