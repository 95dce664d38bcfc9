#include "ros/sensors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <span>

#include "lpss/programs/measuring.h"
#include "lpss/programs/places.h"
#include "lpss/programs/registry.h"

namespace tessera::ros {
namespace {

using Header = std_msgs_msg_dds__Header_;
using Vector3 = geometry_msgs_msg_dds__Vector3_;
using Quaternion = geometry_msgs_msg_dds__Quaternion_;

Header header_of(const Sensor& sensor, const Time& stamp) { return {stamp, text(sensor.frame)}; }

// Three values that follow each other.
Vector3 vector_of(const Sensor& sensor, absl::string_view first) {
  const double* const values = &sensor.values[*place_of(first, find_program(sensor.program.kind)->values())];
  return {values[0], values[1], values[2]};
}

Quaternion orientation_of(const Sensor& sensor) {
  return {value_of(sensor, "qx"), value_of(sensor, "qy"), value_of(sensor, "qz"), value_of(sensor, "qw")};
}

// Of a matrix with so many rows: the same deviation along some of its axes, from `first` on.
void set_deviation(std::span<double> covariance, std::size_t rows, double deviation, std::size_t first = 0,
                   std::size_t axes = 3) {
  for (std::size_t n = first; n < first + axes; ++n) covariance[n * (rows + 1)] = deviation * deviation;
}

absl::Status publish_imu(const Sensor& sensor, const Time& stamp) {
  sensor_msgs_msg_dds__Imu_ message{};
  message.header = header_of(sensor, stamp);
  message.orientation = orientation_of(sensor);
  message.angular_velocity = vector_of(sensor, "turn_x");
  message.linear_acceleration = vector_of(sensor, "acceleration_x");
  set_deviation(message.angular_velocity_covariance, 3, parameter_of(sensor.program, "turn_noise"));
  set_deviation(message.linear_acceleration_covariance, 3, parameter_of(sensor.program, "noise"));
  return write(sensor.writer, &message, sensor.topic);
}

// The angles of a fan, as the program ranger has them.
struct Angles {
  double first = 0;
  double step = 0;
};
Angles angles_of(double middle, double angle, double count) {
  return {middle - (count > 1 ? angle / 2 : 0), count > 1 ? angle / (count - 1) : 0};
}

bool is_flat(const FoundProgram& program) { return parameter_of(program, "rows") <= 1; }

// The distances along its rays; infinite where there is nothing.
std::vector<float> ranges_of(const Sensor& sensor) {
  const double most = parameter_of(sensor.program, "most");
  const std::size_t first = *place_of("range_0", find_program("ranger")->values());
  std::vector<float> ranges;
  for (std::size_t n = first; n < sensor.values.size(); ++n) {
    const double range = sensor.values[n];
    ranges.push_back(range < most ? static_cast<float>(range) : std::numeric_limits<float>::infinity());
  }
  return ranges;
}

absl::Status publish_scan(const Sensor& sensor, const Time& stamp) {
  const auto number = [&](absl::string_view name) { return parameter_of(sensor.program, name); };
  const Angles angles = angles_of(number("heading"), number("angle"), number("rays"));
  std::vector<float> ranges = ranges_of(sensor);
  const auto count = static_cast<std::uint32_t>(ranges.size());
  sensor_msgs_msg_dds__LaserScan_ message{};
  message.header = header_of(sensor, stamp);
  message.angle_min = static_cast<float>(angles.first);
  message.angle_max = static_cast<float>(angles.first + angles.step * (number("rays") - 1));
  message.angle_increment = static_cast<float>(angles.step);
  message.scan_time = number("rate") > 0 ? static_cast<float>(1 / number("rate")) : 0;
  message.range_min = static_cast<float>(number("least"));
  message.range_max = static_cast<float>(number("most"));
  message.ranges = {count, count, ranges.data(), /*_release=*/false};
  return write(sensor.writer, &message, sensor.topic);
}

absl::Status publish_points(const Sensor& sensor, const Time& stamp) {
  constexpr std::uint8_t kFloat32 = 7;  // PointField's number for it
  const auto number = [&](absl::string_view name) { return parameter_of(sensor.program, name); };
  const Angles headings = angles_of(number("heading"), number("angle"), number("rays"));
  const Angles rises = angles_of(number("elevation"), number("row_angle"), number("rows"));
  const std::vector<float> ranges = ranges_of(sensor);
  const auto rays = static_cast<std::size_t>(number("rays"));
  std::vector<std::array<float, 3>> points;
  for (std::size_t n = 0; n < ranges.size(); ++n) {
    if (!std::isfinite(ranges[n])) continue;
    const std::size_t row = n / rays;
    const double rise = rises.first + rises.step * static_cast<double>(row);
    const double heading = headings.first + headings.step * static_cast<double>(n - row * rays);
    const double range = ranges[n];
    points.push_back({static_cast<float>(range * std::cos(rise) * std::cos(heading)),
                      static_cast<float>(range * std::cos(rise) * std::sin(heading)),
                      static_cast<float>(range * std::sin(rise))});
  }
  std::array<std::string, 3> names = {"x", "y", "z"};
  std::array<sensor_msgs_msg_dds__PointField_, 3> fields;
  for (std::uint32_t n = 0; n < fields.size(); ++n) fields[n] = {names[n].data(), 4 * n, kFloat32, 1};
  sensor_msgs_msg_dds__PointCloud2_ message{};
  message.header = header_of(sensor, stamp);
  message.height = 1;
  message.width = static_cast<std::uint32_t>(points.size());
  message.fields = {3, 3, fields.data(), /*_release=*/false};
  message.point_step = sizeof(points[0]);
  message.row_step = message.point_step * message.width;
  message.data = {message.row_step, message.row_step, reinterpret_cast<std::uint8_t*>(points.data()),
                  /*_release=*/false};
  message.is_dense = true;
  return write(sensor.writer, &message, sensor.topic);
}

absl::Status publish_fix(const Sensor& sensor, const Time& stamp) {
  constexpr std::uint16_t kGps = 1;
  constexpr std::uint8_t kDiagonalKnown = 2;
  sensor_msgs_msg_dds__NavSatFix_ message{};
  message.header = header_of(sensor, stamp);
  message.status.service = kGps;
  message.latitude = value_of(sensor, "latitude");
  message.longitude = value_of(sensor, "longitude");
  message.altitude = value_of(sensor, "height");
  set_deviation(message.position_covariance, 3, parameter_of(sensor.program, "noise"), 0, 2);
  set_deviation(message.position_covariance, 3, parameter_of(sensor.program, "height_noise"), 2, 1);
  message.position_covariance_type = kDiagonalKnown;
  return write(sensor.writer, &message, sensor.topic);
}

absl::Status publish_field(const Sensor& sensor, const Time& stamp) {
  sensor_msgs_msg_dds__MagneticField_ message{};
  message.header = header_of(sensor, stamp);
  message.magnetic_field = vector_of(sensor, "field_x");
  set_deviation(message.magnetic_field_covariance, 3, parameter_of(sensor.program, "noise"));
  return write(sensor.writer, &message, sensor.topic);
}

absl::Status publish_pressure(const Sensor& sensor, const Time& stamp) {
  const double noise = parameter_of(sensor.program, "noise");
  const sensor_msgs_msg_dds__FluidPressure_ message{header_of(sensor, stamp), value_of(sensor, "pressure"),
                                                    noise * noise};
  return write(sensor.writer, &message, sensor.topic);
}

absl::Status publish_wrench(const Sensor& sensor, const Time& stamp) {
  const geometry_msgs_msg_dds__WrenchStamped_ message{
      header_of(sensor, stamp), {vector_of(sensor, "force_x"), vector_of(sensor, "torque_x")}};
  return write(sensor.writer, &message, sensor.topic);
}

absl::Status publish_pose(const Sensor& sensor, const Time& stamp) {
  nav_msgs_msg_dds__Odometry_ message{};
  message.header = header_of(sensor, stamp);
  message.child_frame_id = text(sensor.body_frame);
  const Vector3 place = vector_of(sensor, "x");
  message.pose.pose = {{place.x, place.y, place.z}, orientation_of(sensor)};
  message.twist.twist = {vector_of(sensor, "velocity_x"), vector_of(sensor, "rate_x")};
  set_deviation(message.pose.covariance, 6, parameter_of(sensor.program, "noise"));
  set_deviation(message.pose.covariance, 6, parameter_of(sensor.program, "turn_noise"), 3);
  return write(sensor.writer, &message, sensor.topic);
}

// What its wheels tell a robot.
absl::Status publish_wheels(const Sensor& sensor, const Time& stamp) {
  nav_msgs_msg_dds__Odometry_ message{};
  message.header = header_of(sensor, stamp);
  message.child_frame_id = text(sensor.body_frame);
  const double half = value_of(sensor, "heading") / 2;
  message.pose.pose = {{value_of(sensor, "x"), value_of(sensor, "y"), 0},
                       {0, 0, std::sin(half), std::cos(half)}};
  message.twist.twist.linear.x = value_of(sensor, "speed");
  message.twist.twist.angular.z = value_of(sensor, "turn");
  return write(sensor.writer, &message, sensor.topic);
}

constexpr SensorKind kScan{"ranger", "scan", &sensor_msgs_msg_dds__LaserScan__desc, publish_scan};
constexpr SensorKind kPoints{"ranger", "points", &sensor_msgs_msg_dds__PointCloud2__desc, publish_points};
constexpr std::array kKinds = {
    SensorKind{"ackermann", "odom", &nav_msgs_msg_dds__Odometry__desc, publish_wheels},
    SensorKind{"barometer", "pressure", &sensor_msgs_msg_dds__FluidPressure__desc, publish_pressure},
    SensorKind{"diff_drive", "odom", &nav_msgs_msg_dds__Odometry__desc, publish_wheels},
    SensorKind{"imu", "imu", &sensor_msgs_msg_dds__Imu__desc, publish_imu},
    SensorKind{"load", "wrench", &geometry_msgs_msg_dds__WrenchStamped__desc, publish_wrench},
    SensorKind{"magnetometer", "magnetic_field", &sensor_msgs_msg_dds__MagneticField__desc, publish_field},
    SensorKind{"pose", "ground_truth", &nav_msgs_msg_dds__Odometry__desc, publish_pose},
    kScan,
    SensorKind{"satellite", "fix", &sensor_msgs_msg_dds__NavSatFix__desc, publish_fix},
};

}  // namespace

const SensorKind* find_sensor_kind(const FoundProgram& program) {
  const auto found = std::ranges::find(kKinds, absl::string_view(program.kind), &SensorKind::program);
  if (found == kKinds.end()) return nullptr;
  static constexpr SensorKind kInRows = kPoints;
  return found->program == kScan.program && !is_flat(program) ? &kInRows : &*found;
}

double parameter_of(const FoundProgram& program, absl::string_view name) {
  const auto found = std::ranges::find(program.parameters, name, &NamedNumber::name);
  return found == program.parameters.end() ? 0 : found->value;
}

double value_of(const Sensor& sensor, absl::string_view name) {
  const Program* const program = find_program(sensor.program.kind);
  const auto place = program == nullptr ? std::nullopt : place_of(name, program->values());
  return place && *place < sensor.values.size() ? sensor.values[*place] : 0;
}

std::optional<Pose> mounting_of(const FoundProgram& program) {
  const auto number = [&](absl::string_view name) { return parameter_of(program, name); };
  if (program.kind != "imu" && program.kind != "ranger" && program.kind != "magnetometer")
    return std::nullopt;
  return Pose{{number("x"), number("y"), number("z")},
              turned_by(number("roll"), number("pitch"), number("yaw"))};
}

bool measures_since(const Sensor& sensor, Tick before, Tick tick, double time_step) {
  const double rate = parameter_of(sensor.program, "rate");
  if (rate == 0) return true;
  const auto until = [&](Tick at) {
    return measurements_until(sensor.program.body, sensor.program.program, at, time_step, rate);
  };
  return until(tick) != until(before);
}

}  // namespace tessera::ros
