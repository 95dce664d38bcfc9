#include "ros/sensors.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <span>

#include "lpss/programs/measuring.h"
#include "lpss/programs/places.h"
#include "lpss/programs/ray_fan.h"
#include "lpss/programs/registry.h"

namespace tessera::ros {
namespace {

constexpr double kFlatAngleMax = 3.1;  // rad, that a plane can be seen in

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
  const RayFan fan = live::fan_of(sensor.program);
  const auto angle_of = [&](std::size_t n) {
    return static_cast<float>(RayFan::angle_at(fan.heading, fan.angle, fan.rays, n));
  };
  std::vector<float> ranges = ranges_of(sensor);
  const auto count = static_cast<std::uint32_t>(ranges.size());
  sensor_msgs_msg_dds__LaserScan_ message{};
  message.header = header_of(sensor, stamp);
  message.angle_min = angle_of(0);
  message.angle_max = angle_of(fan.rays - 1);
  message.angle_increment =
      fan.rays > 1 ? static_cast<float>(fan.angle / static_cast<double>(fan.rays - 1)) : 0;
  message.scan_time = number("rate") > 0 ? static_cast<float>(1 / number("rate")) : 0;
  message.range_min = static_cast<float>(number("least"));
  message.range_max = static_cast<float>(number("most"));
  message.ranges = {count, count, ranges.data(), /*_release=*/false};
  return write(sensor.writer, &message, sensor.topic);
}

using Point = std::array<float, 3>;

absl::Status publish_cloud(const Sensor& sensor, const Time& stamp, std::vector<Point>& points,
                           std::uint32_t rows, bool is_dense) {
  constexpr std::uint8_t kFloat32 = 7;  // PointField's number for it
  std::array<std::string, 3> names = {"x", "y", "z"};
  std::array<sensor_msgs_msg_dds__PointField_, 3> fields;
  for (std::uint32_t n = 0; n < fields.size(); ++n) fields[n] = {names[n].data(), 4 * n, kFloat32, 1};
  const auto size = static_cast<std::uint32_t>(points.size() * sizeof(Point));
  sensor_msgs_msg_dds__PointCloud2_ message{};
  message.header = header_of(sensor, stamp);
  message.height = rows;
  message.width = static_cast<std::uint32_t>(points.size()) / rows;
  message.fields = {3, 3, fields.data(), /*_release=*/false};
  message.point_step = sizeof(Point);
  message.row_step = message.point_step * message.width;
  message.data = {size, size, reinterpret_cast<std::uint8_t*>(points.data()), /*_release=*/false};
  message.is_dense = is_dense;
  return write(sensor.writer, &message, sensor.topic);
}

// What rays meet.
absl::Status publish_points(const Sensor& sensor, const Time& stamp) {
  const RayFan fan = live::fan_of(sensor.program);
  const std::vector<float> ranges = ranges_of(sensor);
  std::vector<Point> points;
  for (std::size_t n = 0; n < ranges.size(); ++n) {
    if (!std::isfinite(ranges[n])) continue;
    const Eigen::Vector3f point = (ranges[n] * fan.direction(n)).cast<float>();
    points.push_back({point.x(), point.y(), point.z()});
  }
  return publish_cloud(sensor, stamp, points, 1, /*is_dense=*/true);
}

// The pixels of a depth camera by rows, from the left of the uppermost row on: along the axes of an image.
// Where there is nothing, they are not finite.
std::vector<Point> pixels_of(const Sensor& sensor) {
  const RayFan fan = live::fan_of(sensor.program);
  const std::vector<float> ranges = ranges_of(sensor);
  std::vector<Point> pixels;
  for (std::size_t n = ranges.size(); n-- > 0;) {
    const Eigen::Vector3f ray = fan.direction(n).cast<float>();
    const float range = ranges[n];
    pixels.push_back(std::isfinite(range) ? Point{-range * ray.y(), -range * ray.z(), range * ray.x()}
                                          : Point{NAN, NAN, NAN});
  }
  return pixels;
}

std::uint32_t rows_of(const Sensor& sensor) {
  const RayFan fan = live::fan_of(sensor.program);
  return static_cast<std::uint32_t>(fan.count() / fan.rays);
}

absl::Status publish_depth_points(const Sensor& sensor, const Time& stamp) {
  std::vector<Point> pixels = pixels_of(sensor);
  return publish_cloud(sensor, stamp, pixels, rows_of(sensor), /*is_dense=*/false);
}

absl::Status publish_depth_image(const Sensor& sensor, const Time& stamp) {
  std::vector<float> depths;
  for (const Point& pixel : pixels_of(sensor)) depths.push_back(pixel[2]);
  std::string encoding = "32FC1";
  const auto size = static_cast<std::uint32_t>(depths.size() * sizeof(float));
  sensor_msgs_msg_dds__Image_ message{};
  message.header = header_of(sensor, stamp);
  message.height = rows_of(sensor);
  message.width = static_cast<std::uint32_t>(depths.size()) / message.height;
  message.encoding = encoding.data();
  message.step = message.width * static_cast<std::uint32_t>(sizeof(float));
  message.data = {size, size, reinterpret_cast<std::uint8_t*>(depths.data()), /*_release=*/false};
  return write(sensor.writer, &message, sensor.topic);
}

// The intrinsics of a camera, pixels: its focal lengths, and where its line of sight meets the image.
struct Lens {
  double across = 1;
  double down = 1;
  double centre_x = 0;
  double centre_y = 0;
  std::array<double, 5> distortion{};  // "plumb_bob"
};

absl::Status publish_info(const Sensor& sensor, const Time& stamp, std::uint32_t width, std::uint32_t height,
                          Lens lens) {
  std::string model = "plumb_bob";
  sensor_msgs_msg_dds__CameraInfo_ message{};
  message.header = header_of(sensor, stamp);
  message.height = height;
  message.width = width;
  message.distortion_model = model.data();
  message.d = {5, 5, lens.distortion.data(), /*_release=*/false};
  const auto& [across, down, x, y, distortion] = lens;
  for (const auto& [place, value] : {std::pair{0, across}, {2, x}, {4, down}, {5, y}, {8, 1.0}})
    message.k[place] = value;
  for (const auto& [place, value] : {std::pair{0, across}, {2, x}, {5, down}, {6, y}, {10, 1.0}})
    message.p[place] = value;
  for (const int diagonal : {0, 4, 8}) message.r[diagonal] = 1;
  return write(sensor.writer, &message, sensor.topic);
}

// For a depth camera, in whose image the middle of the first pixel is at (0, 0).
absl::Status publish_depth_info(const Sensor& sensor, const Time& stamp) {
  const RayFan fan = live::fan_of(sensor.program);
  const std::uint32_t height = rows_of(sensor);
  const auto width = static_cast<std::uint32_t>(fan.rays);
  return publish_info(sensor, stamp, width, height,
                      {.across = width / (2 * fan.half_width()),
                       .down = static_cast<double>(fan.rows) / (2 * fan.half_height()),
                       .centre_x = (width - 1) / 2.0,
                       .centre_y = height - static_cast<double>(fan.rows) / 2 - 0.5});
}

// For a camera that has no images, as Gazebo tells it: the corner of the first pixel is at (0, 0).
absl::Status publish_camera_info(const Sensor& sensor, const Time& stamp) {
  const auto number = [&](absl::string_view name) { return parameter_of(sensor.program, name); };
  const auto or_else = [](double given, double otherwise) { return given > 0 ? given : otherwise; };
  const double width = std::floor(number("width"));
  const double height = std::floor(number("height"));
  const double focal = width / (2 * std::tan(std::min(number("angle"), kFlatAngleMax) / 2));
  const double across = or_else(number("focal_x"), focal);
  return publish_info(sensor, stamp, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
                      {.across = across,
                       .down = or_else(number("focal_y"), across),
                       .centre_x = number("centre_x") < 0 ? width / 2 : number("centre_x"),
                       .centre_y = number("centre_y") < 0 ? height / 2 : number("centre_y"),
                       .distortion = {number("k1"), number("k2"), number("p1"), number("p2"), number("k3")}});
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

constexpr std::array kCameraKinds = {
    SensorKind{"ranger", "camera", "/points", &sensor_msgs_msg_dds__PointCloud2__desc, publish_depth_points},
    SensorKind{"ranger", "camera", "/depth/image_raw", &sensor_msgs_msg_dds__Image__desc,
               publish_depth_image},
    SensorKind{"ranger", "camera", "/depth/camera_info", &sensor_msgs_msg_dds__CameraInfo__desc,
               publish_depth_info},
};
constexpr std::array kPointsKind = {
    SensorKind{"ranger", "points", "", &sensor_msgs_msg_dds__PointCloud2__desc, publish_points}};
constexpr std::array kKinds = {
    SensorKind{"ackermann", "odom", "", &nav_msgs_msg_dds__Odometry__desc, publish_wheels},
    SensorKind{"barometer", "pressure", "", &sensor_msgs_msg_dds__FluidPressure__desc, publish_pressure},
    SensorKind{"camera", "camera", "/camera_info", &sensor_msgs_msg_dds__CameraInfo__desc,
               publish_camera_info},
    SensorKind{"diff_drive", "odom", "", &nav_msgs_msg_dds__Odometry__desc, publish_wheels},
    SensorKind{"imu", "imu", "", &sensor_msgs_msg_dds__Imu__desc, publish_imu},
    SensorKind{"load", "wrench", "", &geometry_msgs_msg_dds__WrenchStamped__desc, publish_wrench},
    SensorKind{"magnetometer", "magnetic_field", "", &sensor_msgs_msg_dds__MagneticField__desc,
               publish_field},
    SensorKind{"pose", "ground_truth", "", &nav_msgs_msg_dds__Odometry__desc, publish_pose},
    SensorKind{"ranger", "scan", "", &sensor_msgs_msg_dds__LaserScan__desc, publish_scan},
    SensorKind{"satellite", "fix", "", &sensor_msgs_msg_dds__NavSatFix__desc, publish_fix},
};

}  // namespace

std::span<const SensorKind> sensor_kinds(const FoundProgram& program) {
  if (is_camera(program)) return kCameraKinds;
  if (program.kind == "ranger" && parameter_of(program, "rows") > 1) return kPointsKind;
  const auto found = std::ranges::find(kKinds, absl::string_view(program.kind), &SensorKind::program);
  return found == kKinds.end() ? std::span<const SensorKind>() : std::span(&*found, 1);
}

std::vector<std::string> names_in_gazebo(const SensorKind& kind, const std::string& name) {
  if (kind.type == &nav_msgs_msg_dds__Odometry__desc) return {name, "odometry"};
  std::vector<std::string> names = {name, absl::StrCat(name, kind.part)};
  if (kind.type == &sensor_msgs_msg_dds__PointCloud2__desc) names.push_back(absl::StrCat(name, "/points"));
  if (kind.type == &sensor_msgs_msg_dds__Image__desc) names.push_back(absl::StrCat(name, "/depth_image"));
  if (kind.type == &sensor_msgs_msg_dds__CameraInfo__desc) {
    names.push_back(absl::StrCat(name, "/camera_info"));
    names.emplace_back("/camera_info");  // of a camera whose topic is one word
  }
  return names;
}

bool has_measured(const Sensor& sensor) {
  return !sensor.values.empty() || find_program(sensor.program.kind)->values().empty();
}

bool has_image(const FoundProgram& program) { return is_camera(program) || program.kind == "camera"; }

double value_of(const Sensor& sensor, absl::string_view name) {
  const Program* const program = find_program(sensor.program.kind);
  const auto place = program == nullptr ? std::nullopt : place_of(name, program->values());
  return place && *place < sensor.values.size() ? sensor.values[*place] : 0;
}

std::optional<Pose> frame_in_body(const FoundProgram& program) {
  const std::optional<Pose> mounting = live::mounting_of(program);
  const Pose image{Eigen::Vector3d::Zero(), Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)};
  return mounting && has_image(program) ? *mounting * image : mounting;
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
