// Messages of sensors, to the byte: messages.tsv has been read by decoders of others (docs/ros.md).
#include "ros/sensors.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>

#include "lpss/programs/registry.h"
#include "ros/received_for_tests.h"
#include "transport/dds_network.h"

namespace tessera::ros {
namespace {

// A sensor whose values are 0.5, 1.5, 2.5, ... and whose parameters are as at first, but for those that are
// given.
Sensor sensor_of(const std::string& kind, const std::vector<NamedNumber>& given = {}) {
  Sensor sensor;
  ProgramRecord record = *new_program(kind);
  for (const NamedNumber& number : given) EXPECT_TRUE(set_number(record, number.name, number.value).ok());
  complete(record);
  const Program& program = *find_program(kind);
  sensor.program.kind = kind;
  for (std::size_t n = 0; n < record.parameters.size(); ++n)
    sensor.program.parameters.push_back({std::string(program.parameters()[n].name), record.parameters[n]});
  for (std::size_t n = 0; n < record.values.size(); ++n)
    sensor.values.push_back(static_cast<double>(n) + 0.5);
  sensor.kind = &sensor_kinds(sensor.program).front();
  sensor.topic = absl::StrCat("/test/", kind, given.size());
  sensor.frame = "robot/eye";
  sensor.body_frame = "robot/head";
  return sensor;
}

// One of the topics of a depth camera of 3 x 2 pixels; the second and the third one are empty.
Sensor camera(absl::string_view part) {
  Sensor sensor = sensor_of("ranger", {{"rays", 3},
                                       {"rows", 2},
                                       {"angle", 2 * std::atan(0.75)},
                                       {"row_angle", 2 * std::atan(0.5)},
                                       {"most", 6},
                                       {"plane", 1}});
  sensor.values[6] = sensor.values[7] = 6;
  for (const SensorKind& kind : sensor_kinds(sensor.program)) {
    if (kind.part == part) sensor.kind = &kind;
  }
  absl::StrAppend(&sensor.topic, part);
  return sensor;
}

// By the name of the type.
std::map<std::string, std::string> golden_messages() {
  std::map<std::string, std::string> messages;
  std::ifstream in(TESSERA_ROS_MESSAGES);
  for (std::string line; std::getline(in, line);) {
    const std::pair<std::string, std::string> parts = absl::StrSplit(line, absl::MaxSplits('\t', 1));
    messages.insert(parts);
  }
  return messages;
}

TEST(SensorMessages, AreThoseOfRosToTheByte) {
  setenv("CYCLONEDDS_URI", dds_configuration({}).c_str(), 1);
  const auto domain = static_cast<std::uint32_t>(getpid() % 100 + 100);
  const std::unique_ptr<Node> node = Node::open(domain).value();
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  const std::map<std::string, std::string> golden = golden_messages();
  std::string all;
  for (const auto& [type, sensor] :
       {std::pair{"sensor_msgs/Imu", sensor_of("imu", {{"noise", 0.5}, {"turn_noise", 2}})},
        {"sensor_msgs/LaserScan", sensor_of("ranger", {{"rays", 3}, {"angle", 2}, {"most", 4}, {"rate", 8}})},
        {"sensor_msgs/PointCloud2",
         sensor_of("ranger", {{"rays", 1}, {"rows", 3}, {"row_angle", 1}, {"most", 4}})},
        {"sensor_msgs/PointCloud2 of a camera", camera("/points")},
        {"sensor_msgs/Image", camera("/depth/image_raw")},
        {"sensor_msgs/CameraInfo", camera("/depth/camera_info")},
        {"sensor_msgs/CameraInfo without images",
         sensor_of("camera", {{"width", 640}, {"height", 480}, {"focal_x", 500}, {"k1", 0.25}, {"p1", 0.5}})},
        {"sensor_msgs/NavSatFix", sensor_of("satellite", {{"noise", 0.5}, {"height_noise", 2}})},
        {"sensor_msgs/MagneticField", sensor_of("magnetometer", {{"noise", 0.5}})},
        {"sensor_msgs/FluidPressure", sensor_of("barometer", {{"noise", 0.5}})},
        {"geometry_msgs/WrenchStamped", sensor_of("load")},
        {"nav_msgs/Odometry", sensor_of("pose", {{"noise", 0.5}, {"turn_noise", 0.25}})}}) {
    Sensor published = sensor;
    const SensorKind& kind = *published.kind;
    const dds_entity_t topic = dds_create_topic(
        participant, kind.type, absl::StrCat("rt", published.topic).c_str(), nullptr, nullptr);
    const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
    published.writer = node->writer(*kind.type, published.topic).value();
    ASSERT_TRUE(kind.publish(published, {7, 250'000'000}).ok());
    const std::string received = next_message(reader);
    EXPECT_EQ(received, golden.contains(type) ? golden.at(type) : "") << type;
    absl::StrAppend(&all, type, "\t", received, "\n");
  }
  EXPECT_FALSE(HasFailure()) << "messages.tsv would be:\n" << all;
  dds_delete_qos(qos);
  dds_delete(participant);
}

TEST(SensorMessages, OneWithARateIsToldAsOftenAsItMeasures) {
  const Sensor sensor = sensor_of("ranger", {{"rate", 10}});
  int told = 0;
  for (Tick tick = 1; tick <= 600; ++tick) told += measures_since(sensor, tick - 1, tick, 1.0 / 60) ? 1 : 0;
  EXPECT_EQ(told, 100);
  EXPECT_TRUE(measures_since(sensor, 60, 70, 1.0 / 60)) << "also where ticks in between are not published";
}

}  // namespace
}  // namespace tessera::ros
