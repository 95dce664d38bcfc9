#include "lpss/simulation/example_robots.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

namespace tessera {
namespace {

void add_wheel(WorldBuilder& builder, const std::string& name, Tread tread, double radius,
               const Eigen::Vector3d& place) {
  const ShapeId shape =
      tread == Tread::kBall ? builder.shape(Sphere{radius}) : builder.shape(Cylinder{radius, 0.04});
  BodyDescription& wheel = builder.add(name, shape, 1, place);
  wheel.pose.orientation = Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitX());
  wheel.properties.friction = 1;
}

void attach(WorldBuilder& builder, const std::string& body, absl::string_view kind, ProgramNumbers numbers,
            const ProgramNumbers& more) {
  numbers.insert(numbers.end(), more.begin(), more.end());
  std::ranges::find(builder.world().bodies, body, &BodyDescription::name)
      ->programs.push_back(example_program(kind, numbers));
}

// Of the left and right wheels.
std::array<std::pair<std::string, double>, 2> sides(const std::string& name, double track) {
  return {std::pair(name + "_left", track / 2), std::pair(name + "_right", -track / 2)};
}

}  // namespace

double joint_number(const WorldBuilder& builder, const std::string& name) {
  const auto& joints = builder.world().joints;
  return static_cast<double>(std::ranges::find(joints, name, &JointDescription::name) - joints.begin() + 1);
}

void add_robot(WorldBuilder& builder, const std::string& name, Tread tread, const Eigen::Vector3d& place,
               const ProgramNumbers& numbers) {
  constexpr RobotSize kSize = kExampleRobot;
  builder.add(name, builder.shape(Box{{0.5, 0.4, 0.08}}), 10,
              place + Eigen::Vector3d(0, 0, kSize.radius + 0.02));
  for (const auto& [wheel, y] : sides(name, kSize.track)) {
    const Eigen::Vector3d hub = place + Eigen::Vector3d(0, y, kSize.radius);
    add_wheel(builder, wheel, tread, kSize.radius, hub);
    builder.tie(wheel, JointType::kRevolute, name, wheel, hub, Eigen::Vector3d::UnitY());
  }
  for (const auto& [castor, x] : {std::pair(name + "_front", 0.2), std::pair(name + "_rear", -0.2)}) {
    const Eigen::Vector3d middle = place + Eigen::Vector3d(x, 0, 0.05);
    builder.add(castor, builder.shape(Sphere{0.05}), 0.5, middle).properties.friction = 0;
    builder.tie(castor, JointType::kFixed, name, castor, middle);
  }
  attach(builder, name, "diff_drive",
         {{"left", joint_number(builder, name + "_left")},
          {"right", joint_number(builder, name + "_right")},
          {"radius", kSize.radius},
          {"track", kSize.track}},
         numbers);
}

void add_rover(WorldBuilder& builder, const std::string& name, Tread tread, const Eigen::Vector3d& place,
               const ProgramNumbers& numbers) {
  constexpr RobotSize kSize = kExampleRover;
  builder.add(name, builder.shape(Box{{1, 0.3, 0.1}}), 20, place + Eigen::Vector3d(0, 0, 0.3));
  for (const auto& [side, y] : sides(name, kSize.track)) {
    const Eigen::Vector3d rear = place + Eigen::Vector3d(-kSize.wheelbase / 2, y, kSize.radius);
    add_wheel(builder, side, tread, kSize.radius, rear);
    builder.tie(side, JointType::kRevolute, name, side, rear, Eigen::Vector3d::UnitY());
    const std::string knuckle = side + "_knuckle";
    const Eigen::Vector3d front = place + Eigen::Vector3d(kSize.wheelbase / 2, y, kSize.radius);
    builder.add(knuckle, builder.shape(Box{{0.06, 0.02, 0.06}}), 1, front).properties.inertia = {0.005, 0.005,
                                                                                                 0.005};
    builder.tie(knuckle, JointType::kRevolute, name, knuckle, front, Eigen::Vector3d::UnitZ());
    const std::string wheel = side + "_front";
    add_wheel(builder, wheel, tread, kSize.radius, front);
    builder.tie(wheel, JointType::kRevolute, knuckle, wheel, front, Eigen::Vector3d::UnitY());
  }
  attach(builder, name, "ackermann",
         {{"left_steer", joint_number(builder, name + "_left_knuckle")},
          {"right_steer", joint_number(builder, name + "_right_knuckle")},
          {"left", joint_number(builder, name + "_left")},
          {"right", joint_number(builder, name + "_right")},
          {"wheelbase", kSize.wheelbase},
          {"track", kSize.track},
          {"steer_track", kSize.track},
          {"radius", kSize.radius}},
         numbers);
}

}  // namespace tessera
