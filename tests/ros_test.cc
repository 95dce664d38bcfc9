// What a ROS 2 node receives from a cluster: reads the topics as Cyclone DDS would for it.
#include <absl/strings/str_cat.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <functional>
#include <utility>

#include "dds/dds.h"
#include "ros/transforms.h"
#include "tests/cluster_fixture.h"
#include "transport/dds_network.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

constexpr std::int64_t kFar = std::int64_t{1} << 62;
constexpr Tick kTicks = 20;

using ClockMessage = rosgraph_msgs_msg_dds__Clock_;
using TransformMessage = tf2_msgs_msg_dds__TFMessage_;
using Numbers = std::array<double, 7>;  // translation x y z, rotation x y z w

std::pair<std::int32_t, std::uint32_t> count(const ros::Time& time) { return {time.sec, time.nanosec}; }

Numbers numbers(const ros::TransformStamped& transform) {
  const auto& [at, to] = transform.transform;
  return {at.x, at.y, at.z, to.x, to.y, to.z, to.w};
}

Numbers numbers(const BodySample& body, const SectorIndex& sector, double sector_size) {
  const Eigen::Vector3d at = relative_to(body.pose.position, sector, sector_size);
  const Eigen::Quaterniond& to = body.pose.orientation;
  return {at.x(), at.y(), at.z(), to.x(), to.y(), to.z(), to.w()};
}

std::set<std::string> children(const TransformMessage& message) {
  std::set<std::string> names;
  for (std::uint32_t i = 0; i < message.transforms._length; ++i)
    names.insert(message.transforms._buffer[i].child_frame_id);
  return names;
}

class RosTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("CYCLONEDDS_URI", dds_configuration({}).c_str(), 1);
    setenv("ROS_DOMAIN_ID", absl::StrCat(domain_).c_str(), 1);
    participant_ = dds_create_participant(domain_, nullptr, nullptr);
    ASSERT_GT(participant_, 0);
  }
  void TearDown() override {
    dds_delete(participant_);
    unsetenv("CYCLONEDDS_URI");
    unsetenv("ROS_DOMAIN_ID");
  }

  dds_entity_t read(const dds_topic_descriptor_t& type, const char* topic, dds_reliability_kind_t reliability,
                    dds_durability_kind_t durability) const {
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, reliability, DDS_SECS(1));
    dds_qset_durability(qos, durability);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 100);
    const dds_entity_t reader = dds_create_reader(
        participant_, dds_create_topic(participant_, &type, topic, nullptr, nullptr), qos, nullptr);
    dds_delete_qos(qos);
    EXPECT_GT(reader, 0);
    return reader;
  }
  dds_entity_t read_clock() const {
    return read(rosgraph_msgs_msg_dds__Clock__desc, "rt/clock", DDS_RELIABILITY_BEST_EFFORT,
                DDS_DURABILITY_VOLATILE);
  }
  dds_entity_t read_transforms() const {
    return read(tf2_msgs_msg_dds__TFMessage__desc, "rt/tf", DDS_RELIABILITY_RELIABLE,
                DDS_DURABILITY_VOLATILE);
  }
  dds_entity_t read_static_transforms() const {
    return read(tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", DDS_RELIABILITY_RELIABLE,
                DDS_DURABILITY_TRANSIENT_LOCAL);
  }

  // Whether `see` accepts one of the next messages.
  template <typename Message>
  bool await(dds_entity_t reader, const std::function<bool(const Message&)>& see) const {
    const dds_entity_t waitset = dds_create_waitset(participant_);
    const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
    dds_waitset_attach(waitset, condition, 0);
    const dds_time_t deadline = dds_time() + absl::ToInt64Nanoseconds(kPatience);
    bool content = false;
    while (!content && dds_waitset_wait_until(waitset, nullptr, 0, deadline) > 0) {
      void* sample = nullptr;
      dds_sample_info_t info;
      if (dds_take(reader, &sample, &info, 1, 1) != 1) continue;
      content = info.valid_data && see(*static_cast<const Message*>(sample));
      dds_return_loan(reader, &sample, 1);
    }
    dds_delete(condition);
    dds_delete(waitset);
    return content;
  }

  const std::uint32_t domain_ = static_cast<std::uint32_t>(getpid() % 100);
  dds_entity_t participant_ = 0;
};

TEST_F(RosTest, BodiesFarAwayAreNearTheirSectorAndWhereTheStreamSays) {
  const SectorIndex sector{kFar, -kFar, 0};
  WorldDescription world = flat_world(8);
  add(world, solid("tower::ball", sphere(0.5), 10, {{0, 0, 0}, {0.3, 0.2, 5}})).angular_velocity = {1, 2, 3};
  add(world, solid("beyond", sphere(0.5), 10, {{0, 0, 0}, {30, 0, 5}}));
  world.frames.push_back({"tower::tool", 1, {{0, 0, 1}, Eigen::Quaterniond::Identity()}});
  ASSERT_THAT(move_by(world, {kFar, -kFar, 0}), IsOk());
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(world).status(), IsOk());
  const BodyId ball = client.find("tower::ball").value().id;

  const dds_entity_t transforms = read_transforms();
  const Process ros("tessera-ros", {"--connect", cluster.processes->address(), "--sector", "2^62,-2^62,0",
                                    "--reach", "20", "--rate", "1000", "--frame", "map"});
  const std::unique_ptr<BodyStream> stream = client.watch_bodies({.ids = {ball}}, kPatience).value();
  for (Tick tick = 0; tick <= kTicks; ++tick) {
    if (tick > 0) {
      ASSERT_THAT(client.step(1, kPatience).status(), IsOk());
    }
    const BodyFrame frame = stream->next(kPatience).value();
    ASSERT_EQ(frame.tick, tick);
    const ros::Time now = ros::time_at(tick, world.settings.time_step);
    ASSERT_TRUE(await<TransformMessage>(transforms,
                                        [&](const TransformMessage& message) {
                                          EXPECT_EQ(children(message), std::set<std::string>{"tower/ball"});
                                          const ros::TransformStamped& told = message.transforms._buffer[0];
                                          if (count(told.header.stamp) != count(now)) return false;
                                          EXPECT_STREQ(told.header.frame_id, "map");
                                          EXPECT_EQ(numbers(told), numbers(frame.bodies.at(0), sector,
                                                                           world.settings.sector_size));
                                          return true;
                                        }))
        << "tick " << tick << "\n"
        << ros.output();
  }
  // The ground, and the frame on the ball, were published long ago.
  EXPECT_TRUE(await<TransformMessage>(read_static_transforms(), [](const TransformMessage& message) {
    return children(message) == std::set<std::string>{"ground", "tower/tool"};
  })) << ros.output();
}

TEST_F(RosTest, ClockGoesOnAndBeginsAgainWithTheWorld) {
  const WorldDescription world = read_world("falling.sdf");
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  const dds_entity_t clock = read_clock();
  Process ros("tessera-ros",
              {"--connect", cluster.processes->address(), "--bodies", "nobody", "--rate", "1000"});
  ASSERT_THAT(cluster.client->load(world).status(), IsOk());
  ASSERT_THAT(cluster.client->resume().status(), IsOk());
  ros::Time last{};
  int steps = 0;
  EXPECT_TRUE(await<ClockMessage>(clock, [&](const ClockMessage& message) {
    EXPECT_GE(count(message.clock), count(last));
    steps += count(message.clock) > count(last) ? 1 : 0;
    last = message.clock;
    return steps == 10;
  })) << ros.output();
  ASSERT_TRUE(ros.await_output("nobody")) << ros.output();

  ASSERT_THAT(cluster.client->load(world, /*replace=*/true).status(), IsOk());
  EXPECT_TRUE(await<ClockMessage>(clock, [](const ClockMessage& message) {
    return count(message.clock) == std::pair(0, 0u);
  })) << ros.output();
  ros.process().signal(SIGTERM);
  EXPECT_EQ(ros.wait(), 0) << ros.output();
}

TEST_F(RosTest, WhatCannotBeIsTold) {
  Process nobody("tessera-ros", {"--connect", "127.0.0.1:1"});
  EXPECT_EQ(nobody.wait(), 1);
  EXPECT_THAT(nobody.output(), HasSubstr("127.0.0.1:1"));
  Process range("tessera-ros", {"--rate", "0"});
  EXPECT_EQ(range.wait(), 2);
  EXPECT_THAT(range.output(), HasSubstr("--rate"));
  Process both("tessera-ros", {"--reach", "10", "--bodies", "ball"});
  EXPECT_EQ(both.wait(), 2);
  EXPECT_THAT(both.output(), HasSubstr("--bodies"));
}

}  // namespace
}  // namespace tessera
