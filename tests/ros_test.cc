// What a ROS 2 node receives from a cluster: reads the topics as Cyclone DDS would for it.
#include <absl/strings/str_cat.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <utility>

#include "dds/dds.h"
#include "lpss/simulation/simulation.h"
#include "ros/transforms.h"
#include "tests/cluster_fixture.h"
#include "tests/ros_fixture.h"

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

// The numbers of a program, as a client asks for them.
FoundProgram program_of(Client& client, const std::string& body, const std::string& kind) {
  QueryList queries;
  const auto programs = queries.programs({.prefix = body});
  const absl::StatusOr<Answers> answers = client.ask(queries, kPatience);
  EXPECT_THAT(answers.status(), IsOk());
  for (const FoundProgram& program : (*answers)[programs].programs) {
    if (program.kind == kind) return program;
  }
  ADD_FAILURE() << body << " has no " << kind;
  return {};
}

double number_of(const std::vector<NamedNumber>& numbers, const std::string& name) {
  for (const NamedNumber& number : numbers) {
    if (number.name == name) return number.value;
  }
  ADD_FAILURE() << "there is no " << name;
  return 0;
}

TEST_F(RosTest, ARobotTellsWhatItMeasuresAndGoesWhereItIsTold) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("rover.sdf")).status(), IsOk());
  const auto reliable = [&](const dds_topic_descriptor_t& type, const char* topic) {
    return read(type, topic, DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
  };
  const dds_entity_t scans = reliable(sensor_msgs_msg_dds__LaserScan__desc, "rt/robot/scan");
  const dds_entity_t states = reliable(sensor_msgs_msg_dds__JointState__desc, "rt/robot/joint_states");
  const dds_entity_t ways = reliable(nav_msgs_msg_dds__Odometry__desc, "rt/robot/odom");
  const Process ros("tessera-ros", {"--connect", cluster.processes->address(), "--rate", "1000"});

  // Of a world that stands still, all is told again and again.
  ASSERT_THAT(client.step(kTicks, kPatience).status(), IsOk());
  const FoundProgram ranger = program_of(client, "robot::hull", "ranger");
  const std::pair<std::int32_t, std::uint32_t> now = count(ros::time_at(kTicks, 1.0 / 60));
  EXPECT_TRUE(await<sensor_msgs_msg_dds__LaserScan_>(scans, [&](const auto& scan) {
    if (count(scan.header.stamp) != now) return false;
    EXPECT_STREQ(scan.header.frame_id, "robot/hull/scan");
    EXPECT_FLOAT_EQ(scan.angle_min, -1.5);
    EXPECT_FLOAT_EQ(scan.angle_increment, 0.2);
    EXPECT_EQ(scan.ranges._length, 16u);
    for (std::uint32_t n = 0; n < scan.ranges._length; ++n) {
      const double range = number_of(ranger.values, absl::StrCat("range_", n));
      EXPECT_EQ(scan.ranges._buffer[n],
                range < 30 ? static_cast<float>(range) : std::numeric_limits<float>::infinity());
    }
    return true;
  })) << ros.output();
  EXPECT_TRUE(await<sensor_msgs_msg_dds__JointState_>(states, [](const auto& state) {
    EXPECT_EQ(state.name._length, 2u);
    EXPECT_EQ(state.position._length, 2u);
    EXPECT_STREQ(state.name._buffer[0], "left_motor");
    return true;
  })) << ros.output();
  EXPECT_TRUE(await<TransformMessage>(read_static_transforms(), [](const TransformMessage& message) {
    return children(message).contains("robot/hull/scan");
  })) << ros.output();

  const dds_entity_t topic = dds_create_topic(participant_, &geometry_msgs_msg_dds__Twist__desc,
                                              "rt/robot/cmd_vel", nullptr, nullptr);
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  const dds_entity_t velocity = dds_create_writer(participant_, topic, qos, nullptr);
  dds_delete_qos(qos);
  ASSERT_TRUE(await_reader(velocity)) << ros.output();
  geometry_msgs_msg_dds__Twist_ twist{};
  twist.linear.x = 0.25;
  twist.angular.z = -0.5;
  ASSERT_EQ(dds_write(velocity, &twist), 0);
  ASSERT_THAT(client.resume().status(), IsOk());
  EXPECT_TRUE(await<nav_msgs_msg_dds__Odometry_>(ways, [&](const auto& way) {
    EXPECT_STREQ(way.header.frame_id, "robot/odom");
    EXPECT_STREQ(way.child_frame_id, "robot/hull");
    return way.twist.twist.linear.x == twist.linear.x && way.twist.twist.angular.z == twist.angular.z;
  })) << ros.output();
}

// The robot of a Gazebo file drives on, and measures, over the loss of a server.
TEST_F(RosTest, ARobotIsDrivenThroughAHouseWhileAServerIsLost) {
  const Cluster cluster = start_cluster(2, {.checkpoint_every = absl::Milliseconds(100)});
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("house.sdf")).status(), IsOk());
  const dds_entity_t ways = read(nav_msgs_msg_dds__Odometry__desc, "rt/burger/odom", DDS_RELIABILITY_RELIABLE,
                                 DDS_DURABILITY_VOLATILE);
  const dds_entity_t scans = read(sensor_msgs_msg_dds__LaserScan__desc, "rt/burger/scan",
                                  DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
  const Process ros("tessera-ros", {"--connect", cluster.processes->address(), "--rate", "1000"});
  const dds_entity_t velocity = write_to(geometry_msgs_msg_dds__Twist__desc, "rt/burger/cmd_vel");
  ASSERT_TRUE(await_reader(velocity)) << ros.output();
  geometry_msgs_msg_dds__Twist_ twist{};
  twist.linear.x = 0.4;
  ASSERT_EQ(dds_write(velocity, &twist), 0);
  ASSERT_THAT(client.resume().status(), IsOk());
  std::pair<std::int32_t, std::uint32_t> last{};
  double way = 0;
  const auto has_gone = [&](double far) {
    return await<nav_msgs_msg_dds__Odometry_>(ways, [&](const auto& message) {
      EXPECT_GE(count(message.header.stamp), last) << "time does not go back";
      EXPECT_GT(message.pose.pose.position.x, way - 0.05) << "it goes on from where it was";
      last = count(message.header.stamp);
      way = message.pose.pose.position.x;
      return way > far;
    });
  };
  ASSERT_TRUE(has_gone(0.2)) << ros.output();
  ASSERT_EQ(kill(cluster.processes->server(0), SIGKILL), 0);
  ASSERT_THAT(cluster.processes->replace_server(0), IsOk());
  ASSERT_TRUE(has_gone(0.8)) << ros.output();
  const std::pair<std::int32_t, std::uint32_t> now = last;
  EXPECT_TRUE(await<sensor_msgs_msg_dds__LaserScan_>(scans, [&](const auto& scan) {
    EXPECT_EQ(scan.ranges._length, 180u);
    return count(scan.header.stamp) >= now;
  })) << ros.output();
}

// From the tick at which its command takes effect on, it has the bits that it would have had.
TEST_F(RosTest, TheLossOfAServerChangesNoBitOfADrivenRobot) {
  constexpr Tick kDriven = 240;
  const WorldDescription house = read_world("house.sdf");
  const Cluster cluster = start_cluster(2, {.checkpoint_every = absl::Milliseconds(100)});
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(house).status(), IsOk());
  const Process ros("tessera-ros", {"--connect", cluster.processes->address()});
  const dds_entity_t velocity = write_to(geometry_msgs_msg_dds__Twist__desc, "rt/burger/cmd_vel");
  ASSERT_TRUE(await_reader(velocity)) << ros.output();
  geometry_msgs_msg_dds__Twist_ twist{};
  twist.linear.x = 0.4;
  twist.angular.z = 0.3;
  ASSERT_EQ(dds_write(velocity, &twist), 0);
  const absl::Time deadline = absl::Now() + kPatience;
  Tick told = 0;
  FoundProgram drive;
  do {
    ASSERT_LT(absl::Now(), deadline) << ros.output();
    told = client.step(1, kPatience).value();
    drive = program_of(client, "burger::base_link", "diff_drive");
  } while (number_of(drive.inputs, "speed") != twist.linear.x);
  ASSERT_THAT(client.step(kDriven / 2, kPatience).status(), IsOk());
  ASSERT_EQ(kill(cluster.processes->server(1), SIGKILL), 0);
  ASSERT_THAT(cluster.processes->replace_server(1), IsOk());
  ASSERT_THAT(client.step(kDriven / 2, kPatience).status(), IsOk());
  const HashAt hash = client.hash(kPatience).value();
  ASSERT_EQ(hash.tick, told + kDriven);

  const std::unique_ptr<Simulation> alone = Simulation::create(house).value();
  const TellProgram command{drive.body, drive.program, {{0, twist.linear.x}, {1, twist.angular.z}}, {}};
  for (Tick tick = 1; tick <= hash.tick; ++tick)
    alone->step(tick == told ? std::vector<Command>{command} : std::vector<Command>{});
  EXPECT_EQ(hash.hash, alone->hash().to_string());
  EXPECT_EQ(hash.programs, alone->program_hash().to_string());
}

TEST_F(RosTest, TheLossOfTheCoordinatorIsSurvived) {
  cli::LocalClusterOptions options;
  options.checkpoint_every = absl::Milliseconds(200);
  options.store = true;
  const Cluster cluster = start_cluster(1, options);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(read_world("house.sdf")).status(), IsOk());
  const dds_entity_t states = read(sensor_msgs_msg_dds__JointState__desc, "rt/burger/joint_states",
                                   DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
  const Process ros("tessera-ros", {"--connect", cluster.processes->address()});
  ASSERT_THAT(cluster.client->resume().status(), IsOk());
  std::pair<std::int32_t, std::uint32_t> last{};
  const auto tells_until = [&](std::int32_t seconds) {
    return await<sensor_msgs_msg_dds__JointState_>(states, [&](const auto& state) {
      last = count(state.header.stamp);
      return last.first >= seconds;
    });
  };
  ASSERT_TRUE(tells_until(1)) << ros.output();
  ASSERT_EQ(kill(cluster.processes->coordinator(), SIGKILL), 0);
  ASSERT_THAT(cluster.processes->replace_coordinator(), IsOk());
  EXPECT_TRUE(tells_until(last.first + 3)) << ros.output();
}

TEST_F(RosTest, ARobotThatIsTheRootHasTheNamesOfItsStack) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("house.sdf")).status(), IsOk());
  const auto reliable = [&](const dds_topic_descriptor_t& type, const char* topic) {
    return read(type, topic, DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
  };
  const dds_entity_t scans = reliable(sensor_msgs_msg_dds__LaserScan__desc, "rt/front/scan");
  const dds_entity_t transforms = read_transforms();
  const Process ros("tessera-ros", {"--connect", cluster.processes->address(), "--root", "burger", "--tf",
                                    "odom", "--remap", "/scan:=/front/scan"});
  ASSERT_THAT(client.resume().status(), IsOk());
  EXPECT_TRUE(await<sensor_msgs_msg_dds__LaserScan_>(scans, [](const auto& scan) {
    EXPECT_STREQ(scan.header.frame_id, "base_link/scan");
    return true;
  })) << ros.output();
  EXPECT_TRUE(await<TransformMessage>(transforms, [](const TransformMessage& message) {
    EXPECT_EQ(children(message), std::set<std::string>{"base_link"});
    EXPECT_STREQ(message.transforms._buffer[0].header.frame_id, "odom");
    return true;
  })) << ros.output();
}

TEST_F(RosTest, RobotsAreDescribedToWhoeverShowsThem) {
  const std::filesystem::path folder = cli::make_temporary_folder().value();
  const std::string text = "<robot name='arm'><link name='base'/></robot>";
  std::ofstream(folder / "arm.urdf") << text;
  std::ofstream(folder / "world.sdf") << "<sdf version='1.9'/>";
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  const std::string address = cluster.processes->address();
  const Process ros("tessera-ros", {"--connect", address, "--description", (folder / "arm.urdf").string()});
  const dds_entity_t described = read(std_msgs_msg_dds__String__desc, "rt/arm/robot_description",
                                      DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_TRANSIENT_LOCAL);
  EXPECT_TRUE(await<std_msgs_msg_dds__String_>(described, [&](const std_msgs_msg_dds__String_& message) {
    return message.data == text;
  })) << ros.output();
  Process wrong("tessera-ros", {"--connect", address, "--description", (folder / "world.sdf").string()});
  EXPECT_NE(wrong.wait(), 0);
  EXPECT_THAT(wrong.output(), HasSubstr("no <robot>"));
  std::filesystem::remove_all(folder);
}

TEST_F(RosTest, JointsGoWhereTheyAreCommanded) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("rover.sdf")).status(), IsOk());
  const Process ros("tessera-ros",
                    {"--connect", cluster.processes->address(), "--rate", "1000", "--bodies", "arm::upper"});
  const dds_entity_t commands = write_to(sensor_msgs_msg_dds__JointState__desc, "rt/arm/joint_command");
  ASSERT_TRUE(await_reader(commands)) << ros.output();
  std::array<char, 8> elbow = {"elbow"};
  std::array<char*, 1> names = {elbow.data()};
  std::array<double, 1> positions = {0.25};
  sensor_msgs_msg_dds__JointState_ message{};
  std::array<char, 1> no_frame = {""};
  message.header.frame_id = no_frame.data();
  message.name = {1, 1, names.data(), false};
  message.position = {1, 1, positions.data(), false};
  ASSERT_EQ(dds_write(commands, &message), 0);
  ASSERT_THAT(client.resume().status(), IsOk());
  // Its controller has a new set point.
  const absl::Time deadline = absl::Now() + kPatience;
  double set_point = 0;
  const std::unique_ptr<ProgramStream> stream = client.watch_programs({.kind = "pid"}, kPatience).value();
  while (set_point != 0.25 && absl::Now() < deadline) {
    ASSERT_THAT(stream->next(kPatience).status(), IsOk());
    QueryList queries;
    const auto programs = queries.programs({.prefix = "arm::column"});
    const absl::StatusOr<Answers> answers = client.ask(queries, kPatience);
    ASSERT_THAT(answers.status(), IsOk());
    set_point = number_of((*answers)[programs].programs.at(2).inputs, "set_point");
  }
  EXPECT_EQ(set_point, 0.25) << ros.output();
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
  Process remap("tessera-ros", {"--remap", "/scan=/other"});
  EXPECT_EQ(remap.wait(), 2);
  EXPECT_THAT(remap.output(), HasSubstr("must be /NAME:=/OTHER"));
}

}  // namespace
}  // namespace tessera
