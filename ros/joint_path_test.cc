#include "ros/joint_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <string>
#include <vector>

namespace tessera::ros {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::uint32_t size_of(const auto& list) { return static_cast<std::uint32_t>(list.size()); }

// A message, and what it points to.
class Message {
 public:
  explicit Message(std::vector<std::string> joints) : names_(std::move(joints)) {
    for (std::string& name : names_) texts_.push_back(name.data());
  }
  Message& point(double seconds, std::vector<double> positions, std::vector<double> velocities = {}) {
    numbers_.push_back(std::move(positions));
    std::vector<double>& p = numbers_.back();
    numbers_.push_back(std::move(velocities));
    std::vector<double>& v = numbers_.back();
    trajectory_msgs_msg_dds__JointTrajectoryPoint_ added{};
    added.positions = {size_of(p), size_of(p), p.data(), false};
    added.velocities = {size_of(v), size_of(v), v.data(), false};
    added.time_from_start.sec = static_cast<std::int32_t>(seconds);
    added.time_from_start.nanosec = static_cast<std::uint32_t>((seconds - added.time_from_start.sec) * 1e9);
    points_.push_back(added);
    return *this;
  }
  absl::StatusOr<JointPath> path() {
    trajectory_msgs_msg_dds__JointTrajectory_ message{};
    message.joint_names = {size_of(texts_), size_of(texts_), texts_.data(), false};
    message.points = {size_of(points_), size_of(points_), points_.data(), false};
    return JointPath::from(message);
  }

 private:
  std::vector<std::string> names_;
  std::vector<char*> texts_;
  std::deque<std::vector<double>> numbers_;
  std::vector<trajectory_msgs_msg_dds__JointTrajectoryPoint_> points_;
};

TEST(JointPath, GoesStraightFromWhereItBegins) {
  JointPath path = Message({"a", "b"}).point(1, {1, 10}).point(3, {2, 10}).path().value();
  path.begin_at({0, 8});
  EXPECT_EQ(path.seconds(), 3);
  EXPECT_THAT(path.at(-1), ElementsAre(0, 8));
  EXPECT_THAT(path.at(0.5), ElementsAre(0.5, 9));
  EXPECT_THAT(path.at(1), ElementsAre(1, 10));
  EXPECT_THAT(path.at(2), ElementsAre(1.5, 10));
  EXPECT_THAT(path.at(9), ElementsAre(2, 10));
}

// x = t^2 from 0 to 1, and on to where it stands.
TEST(JointPath, IsCubicWhereItHasVelocities) {
  const JointPath path =
      Message({"a"}).point(0, {0}, {0}).point(1, {1}, {2}).point(2, {2}, {0}).path().value();
  EXPECT_THAT(path.at(0.5), ElementsAre(DoubleNear(0.25, 1e-12)));
  const double step = 1e-6;
  EXPECT_NEAR((path.at(1 + step)[0] - path.at(1 - step)[0]) / (2 * step), 2, 1e-5)
      << "without a jump of its speed";
  EXPECT_NEAR((path.at(2)[0] - path.at(2 - step)[0]) / step, 0, 1e-5);
}

TEST(JointPath, WhatIsWrongIsNamed) {
  const auto message_of = [](Message&& message) { return std::string(message.path().status().message()); };
  EXPECT_THAT(message_of(Message({"a"})), HasSubstr("points: 0"));
  EXPECT_THAT(message_of(std::move(Message({}).point(1, {}))), HasSubstr("joint_names"));
  EXPECT_THAT(message_of(std::move(Message({"a", "a"}).point(1, {1, 1}))), HasSubstr("\"a\" comes twice"));
  EXPECT_THAT(message_of(std::move(Message({"a"}).point(1, {1, 2}))), HasSubstr("points[0].positions: 2"));
  EXPECT_THAT(message_of(std::move(Message({"a"}).point(1, {1}, {1, 2}))),
              HasSubstr("points[0].velocities: 2"));
  EXPECT_THAT(message_of(std::move(Message({"a"}).point(1, {1}).point(1, {2}))),
              HasSubstr("points[1].time_from_start"));
  EXPECT_THAT(message_of(std::move(Message({"a"}).point(1, {NAN}))), HasSubstr("must be finite"));
}

}  // namespace
}  // namespace tessera::ros
