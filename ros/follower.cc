#include "ros/follower.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "daemon/log.h"

namespace tessera::ros {
namespace {

constexpr std::size_t kEndedMax = 32;     // goals whose results are kept
constexpr std::size_t kWaitingMax = 256;  // requests for results
constexpr dds_duration_t kGoalWait = DDS_SECS(1);

// Of action_msgs/GoalStatus.
enum GoalStatus : std::int8_t { kUnknown = 0, kExecuting = 2, kSucceeded = 4, kCanceled = 5, kAborted = 6 };
// Of FollowJointTrajectory's result.
enum PathError : std::int32_t { kSuccessful = 0, kGoalToleranceViolated = -5 };
// Of CancelGoal.
enum CancelCode : std::int8_t { kNone = 0, kUnknownGoal = 2, kTerminated = 3 };

using SendGoal = control_msgs_action_dds__FollowJointTrajectory_SendGoal_Request_;
using SendGoalReply = control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response_;
using GetResult = control_msgs_action_dds__FollowJointTrajectory_GetResult_Request_;
using GetResultReply = control_msgs_action_dds__FollowJointTrajectory_GetResult_Response_;
using Cancel = action_msgs_srv_dds__CancelGoal_Request_;
using CancelReply = action_msgs_srv_dds__CancelGoal_Response_;
using GoalInfo = action_msgs_msg_dds__GoalInfo_;

std::array<std::uint8_t, 16> id_of(const unique_identifier_msgs_msg_dds__UUID_& message) {
  std::array<std::uint8_t, 16> id{};
  std::memcpy(id.data(), message.uuid, id.size());
  return id;
}

GoalInfo info_of(const std::array<std::uint8_t, 16>& id, const Time& stamp) {
  GoalInfo info{};
  std::memcpy(info.goal_id.uuid, id.data(), id.size());
  info.stamp = stamp;
  return info;
}

template <typename Reply>
void reply_to(const ServiceEnds& ends, const Reply& reply, absl::string_view what) {
  await_reader(ends.replies, kGoalWait);
  warn(write(ends.replies, &reply, what));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Follower>> Follower::open(Node& node, const std::string& above,
                                                         const std::string& topic,
                                                         std::function<void()> on_data) {
  const std::string action =
      absl::StrCat(above, "joint_trajectory_controller/follow_joint_trajectory/_action/");
  const auto trajectories = node.reader(trajectory_msgs_msg_dds__JointTrajectory__desc, topic, on_data);
  const auto status = node.writer(action_msgs_msg_dds__GoalStatusArray__desc, absl::StrCat(action, "status"),
                                  {.depth = 1, .is_kept = true});
  const auto feedback = node.writer(control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage__desc,
                                    absl::StrCat(action, "feedback"));
  const auto send = node.service(control_msgs_action_dds__FollowJointTrajectory_SendGoal_Request__desc,
                                 control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response__desc,
                                 absl::StrCat(action, "send_goal"), on_data);
  const auto cancel = node.service(action_msgs_srv_dds__CancelGoal_Request__desc,
                                   action_msgs_srv_dds__CancelGoal_Response__desc,
                                   absl::StrCat(action, "cancel_goal"), on_data);
  const auto result = node.service(control_msgs_action_dds__FollowJointTrajectory_GetResult_Request__desc,
                                   control_msgs_action_dds__FollowJointTrajectory_GetResult_Response__desc,
                                   absl::StrCat(action, "get_result"), std::move(on_data));
  absl::Status opened = trajectories.status();
  for (const absl::Status& other :
       {status.status(), feedback.status(), send.status(), cancel.status(), result.status()})
    opened.Update(other);
  if (!opened.ok()) return opened;
  return std::unique_ptr<Follower>(
      new Follower({*trajectories, *status, *feedback, *send, *cancel, *result}));
}

Follower::~Follower() {
  for (const dds_entity_t entity :
       {ends_.topic, ends_.status, ends_.feedback, ends_.send.requests, ends_.send.replies,
        ends_.cancel.requests, ends_.cancel.replies, ends_.result.requests, ends_.result.replies})
    dds_delete(entity);
}

absl::StatusOr<JointPath> Follower::path_of(const Trajectory& message, const Where& where) {
  absl::StatusOr<JointPath> path = JointPath::from(message);
  if (!path.ok()) return path;
  std::vector<double> now;
  for (const std::string& joint : path->joints()) {
    const std::optional<double> position = where(joint);
    if (!position)
      return absl::NotFoundError(absl::StrCat("joint_names: the model has no joint \"", joint, "\""));
    now.push_back(*position);
  }
  path->begin_at(now);
  return path;
}

void Follower::take(Tick now, double time_step, const Where& where) {
  const Time stamp = time_at(now, time_step);
  take_all<Trajectory>(ends_.topic, [&](const Trajectory& message) {
    absl::StatusOr<JointPath> path = path_of(message, where);
    if (!path.ok()) return log_warning(absl::StrCat("joint_trajectory: ", path.status().message()));
    start({.path = *std::move(path), .start = now, .stamp = stamp});
  });
  take_goals(now, stamp, where);
  take_cancellations();
  take_result_requests();
}

void Follower::take_goals(Tick now, const Time& stamp, const Where& where) {
  take_all<SendGoal>(ends_.send.requests, [&](const SendGoal& request) {
    absl::StatusOr<JointPath> path = path_of(request.goal.trajectory, where);
    if (!path.ok()) log_warning(absl::StrCat("follow_joint_trajectory: ", path.status().message()));
    reply_to(ends_.send, SendGoalReply{request.client, request.number, path.ok(), stamp}, "send_goal");
    if (!path.ok()) return;
    Goal goal{.id = id_of(request.goal_id), .path = *std::move(path), .start = now, .stamp = stamp};
    const auto& tolerances = request.goal.goal_tolerance;
    for (std::uint32_t n = 0; n < tolerances._length; ++n) {
      if (tolerances._buffer[n].position > 0)
        goal.tolerances.emplace_back(tolerances._buffer[n].name, tolerances._buffer[n].position);
    }
    goal.late = request.goal.goal_time_tolerance.sec + 1e-9 * request.goal.goal_time_tolerance.nanosec;
    start(std::move(goal));
  });
}

// A request without an id means all.
void Follower::take_cancellations() {
  take_all<Cancel>(ends_.cancel.requests, [&](const Cancel& request) {
    const Id id = id_of(request.goal_info.goal_id);
    const bool means_all = id == Id{};
    CancelReply reply{};
    reply.client = request.client;
    reply.number = request.number;
    GoalInfo canceled{};
    if (active_ && active_->id && (means_all || active_->id == id)) {
      canceled = info_of(*active_->id, active_->stamp);
      reply.goals_canceling = {1, 1, &canceled, /*_release=*/false};
      end(kCanceled, kSuccessful, "it was canceled");
    } else if (!means_all) {
      reply.return_code = find(id) != nullptr ? kTerminated : kUnknownGoal;
    }
    reply_to(ends_.cancel, reply, "cancel_goal");
  });
}

void Follower::take_result_requests() {
  take_all<GetResult>(ends_.result.requests, [&](const GetResult& request) {
    const Id id = id_of(request.goal_id);
    if (answer(id, request.client, request.number)) return;
    if (waiting_.size() == kWaitingMax) waiting_.pop_front();
    waiting_.push_back({id, request.client, request.number});
  });
}

bool Follower::answer(const Id& id, std::uint64_t client, std::int64_t number) {
  if (active_ && active_->id == id) return false;
  const Goal* const goal = find(id);
  std::string why = goal != nullptr ? goal->why : "there is no such goal";
  GetResultReply reply{client, number, goal != nullptr ? goal->status : std::int8_t{kUnknown}, {}};
  reply.result = {goal != nullptr ? goal->error : 0, why.data()};
  reply_to(ends_.result, reply, "get_result");
  return true;
}

const Follower::Goal* Follower::find(const Id& id) const {
  const auto found = std::ranges::find_if(ended_, [&](const Goal& goal) { return goal.id == id; });
  return found == ended_.end() ? nullptr : &*found;
}

void Follower::start(Goal goal) {
  if (active_) end(kAborted, kSuccessful, "another trajectory has come");
  active_ = std::move(goal);
  active_->status = kExecuting;
  publish_status();
}

void Follower::end(std::int8_t status, std::int32_t error, std::string why) {
  active_->status = status;
  active_->error = error;
  active_->why = std::move(why);
  if (active_->id) {
    ended_.push_back(*std::move(active_));
    if (ended_.size() > kEndedMax) ended_.pop_front();
  }
  active_.reset();
  std::erase_if(waiting_, [&](const Waiting& one) { return answer(one.id, one.client, one.number); });
  publish_status();
}

void Follower::forget() {
  if (active_) end(kAborted, kSuccessful, "its model has gone");
}

std::vector<std::pair<std::string, double>> Follower::next(Tick now, double time_step, const Where& where) {
  std::vector<std::pair<std::string, double>> wanted;
  if (!active_) return wanted;
  const JointPath& path = active_->path;
  const double elapsed = static_cast<double>(now - active_->start) * time_step;
  const std::vector<double> positions = path.at(elapsed + time_step);
  for (std::size_t n = 0; n < positions.size(); ++n) wanted.emplace_back(path.joints()[n], positions[n]);
  if (active_->id) publish_feedback(now, time_step, elapsed, where);
  if (elapsed < path.seconds()) return wanted;
  std::string off;
  for (const auto& [joint, tolerance] : active_->tolerances) {
    const auto place = std::ranges::find(path.joints(), joint);
    if (place == path.joints().end()) continue;
    const double error = where(joint).value_or(HUGE_VAL) -
                         path.goal()[static_cast<std::size_t>(place - path.joints().begin())];
    if (std::abs(error) > tolerance)
      off = absl::StrCat(joint, " is off by ", error, ", not within ", tolerance);
  }
  if (off.empty()) {
    end(kSucceeded, kSuccessful, "");
  } else if (elapsed > path.seconds() + active_->late) {
    end(kAborted, kGoalToleranceViolated, off);
  }
  return wanted;
}

void Follower::publish_status() {
  std::vector<action_msgs_msg_dds__GoalStatus_> all;
  for (const Goal& goal : ended_) all.push_back({info_of(*goal.id, goal.stamp), goal.status});
  if (active_ && active_->id) all.push_back({info_of(*active_->id, active_->stamp), active_->status});
  const auto count = static_cast<std::uint32_t>(all.size());
  const action_msgs_msg_dds__GoalStatusArray_ message{{count, count, all.data(), /*_release=*/false}};
  warn(write(ends_.status, &message, "status"));
}

void Follower::publish_feedback(Tick now, double time_step, double elapsed, const Where& where) const {
  const JointPath& path = active_->path;
  std::vector<char*> names;
  std::vector<double> desired = path.at(elapsed);
  std::vector<double> actual;
  std::vector<double> error;
  for (std::size_t n = 0; n < desired.size(); ++n) {
    names.push_back(text(path.joints()[n]));
    actual.push_back(where(path.joints()[n]).value_or(std::numeric_limits<double>::quiet_NaN()));
    error.push_back(desired[n] - actual[n]);
  }
  const auto count = static_cast<std::uint32_t>(names.size());
  const double seconds = std::floor(elapsed);
  const auto point_of = [&](std::vector<double>& positions) {
    trajectory_msgs_msg_dds__JointTrajectoryPoint_ point{};
    point.positions = {count, count, positions.data(), /*_release=*/false};
    point.time_from_start = {static_cast<std::int32_t>(seconds),
                             static_cast<std::uint32_t>((elapsed - seconds) * 1e9)};
    return point;
  };
  control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage_ message{};
  std::memcpy(message.goal_id.uuid, active_->id->data(), active_->id->size());
  const std::string no_frame;
  message.feedback.header = {.stamp = time_at(now, time_step), .frame_id = text(no_frame)};
  message.feedback.joint_names = {count, count, names.data(), /*_release=*/false};
  message.feedback.desired = point_of(desired);
  message.feedback.actual = point_of(actual);
  message.feedback.error = point_of(error);
  warn(write(ends_.feedback, &message, "feedback"));
}

}  // namespace tessera::ros
