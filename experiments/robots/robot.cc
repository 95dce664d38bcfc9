#include "experiments/robots/robot.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/base/portable_math.h"

namespace tessera::robots {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kRobot = 2;  // a category: they collide with the ground's, 1, alone
constexpr double kFriction = 1;
// In [0, 1), as evenly spread as can be: multiples of the golden section, without their whole part.
double spread(std::size_t n) {
  const double multiple = static_cast<double>(n) * std::numbers::phi;
  return multiple - std::floor(multiple);
}

WorldDescription empty_world(const WorldSettings& settings, const Robot& robot) {
  WorldDescription world;
  world.settings = settings;
  for (const Link& link : robot.links) world.shapes.push_back(Shape{link.parts});
  return world;
}

void add_link(const Link& link, const std::string& robot, ShapeId shape, const Vector3d& origin,
              WorldDescription& world) {
  BodyDescription& body = world.bodies.emplace_back();
  body.name = absl::StrCat(robot, "::", link.name);
  body.properties.shape = shape;
  body.properties.mass = link.mass;
  body.properties.inertia = link.inertia;
  body.properties.friction = kFriction;
  body.properties.category = kRobot;
  body.properties.mask = 1;
  const absl::StatusOr<WorldPosition> place =
      canonical(world.anchor, origin + link.pose.position, world.settings.sector_size);
  invariant(place.ok(), "robots are near the anchor");
  body.pose = {*place, link.pose.orientation};
}

// `first`: the place of the robot's first body.
void add_joint(const Robot& robot, const RobotJoint& joint, const std::string& name, std::size_t first,
               WorldDescription& world) {
  JointDescription& made = world.joints.emplace_back();
  made.name = absl::StrCat(name, "::", robot.links[joint.child].name, "_joint");
  JointProperties& properties = made.properties;
  properties.type = joint.hinges.size() == 1 ? JointType::kRevolute : JointType::kUniversal;
  properties.parent = BodyId{first + joint.parent + 1};
  properties.child = BodyId{first + joint.child + 1};
  properties.in_parent = robot.links[joint.parent].pose.inverse() * joint.frame;
  properties.in_child = robot.links[joint.child].pose.inverse() * joint.frame;
}

void add_servos(const RobotJoint& joint, JointDescription& made) {
  for (std::size_t axis = 0; axis < joint.hinges.size(); ++axis) {
    const Hinge& hinge = joint.hinges[axis];
    made.properties.axes[axis].lower = hinge.lower;
    made.properties.axes[axis].upper = hinge.upper;
    made.drives[axis] = {DriveMode::kServo, hinge.middle, hinge.stiffness, hinge.damping};
  }
}

// The motion of a link's centre of mass.
struct Twist {
  Vector3d linear = Vector3d::Zero();   // m/s
  Vector3d angular = Vector3d::Zero();  // rad/s
};

}  // namespace

std::size_t hinges_of(const Robot& robot) {
  std::size_t sum = 0;
  for (const RobotJoint& joint : robot.joints) sum += joint.hinges.size();
  return sum;
}

WorldDescription robots_on_plane(const WorldSettings& settings, const Robot& robot, int count) {
  WorldDescription world = empty_world(settings, robot);
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  for (int n = 0; n < count; ++n) {
    const std::string name = absl::StrCat(robot.name, n);
    const std::size_t first = world.bodies.size();
    const int row = n / side;
    const int column = n % side;
    const double middle = (side - 1) / 2.0;
    const Vector3d origin((column - middle) * robot.apart, (row - middle) * robot.apart, robot.height);
    for (std::size_t link = 0; link < robot.links.size(); ++link)
      add_link(robot.links[link], name, static_cast<ShapeId>(link), origin, world);
    for (const RobotJoint& joint : robot.joints) {
      add_joint(robot, joint, name, first, world);
      add_servos(joint, world.joints.back());
    }
  }
  BodyDescription ground;
  ground.name = "ground";
  ground.properties.motion = Motion::kStatic;
  ground.properties.shape = static_cast<ShapeId>(world.shapes.size());
  ground.properties.friction = kFriction;
  world.shapes.push_back(Shape{{ShapePart{Plane{}, {}}}});
  world.bodies.push_back(std::move(ground));
  return world;
}

std::vector<Command> servo_targets(const Robot& robot, int first, int count, double time) {
  std::vector<Command> commands;
  std::uint64_t id = 0;
  for (int n = first; n < first + count; ++n) {
    std::size_t place = static_cast<std::size_t>(n);
    for (const RobotJoint& joint : robot.joints) {
      SetDrives& set = std::get<SetDrives>(commands.emplace_back(SetDrives{JointId{++id}, {}}));
      for (std::size_t axis = 0; axis < joint.hinges.size(); ++axis, ++place) {
        const Hinge& hinge = joint.hinges[axis];
        const double angle = 2 * std::numbers::pi * (time + spread(place));
        set.drives[axis] = {DriveMode::kServo, hinge.middle + hinge.swing * portable::sincos(angle).sin,
                            hinge.stiffness, hinge.damping};
      }
    }
  }
  return commands;
}

WorldDescription robot_in_space(const WorldSettings& settings, const Robot& robot, int number) {
  constexpr double kFastest = 1;  // rad/s, of a hinge
  WorldDescription world = empty_world(settings, robot);
  world.settings.gravity = UniformGravity{Vector3d::Zero()};
  std::size_t place = static_cast<std::size_t>(number) * hinges_of(robot);
  std::vector<Twist> twists(robot.links.size());
  twists.front() = {{0.3, -0.2, 0.1}, {2 * spread(place) - 1, 2 * spread(place + 1) - 1, 1}};
  for (std::size_t link = 0; link < robot.links.size(); ++link)
    add_link(robot.links[link], robot.name, static_cast<ShapeId>(link), Vector3d::Zero(), world);
  for (const RobotJoint& joint : robot.joints) {
    add_joint(robot, joint, robot.name, 0, world);
    const Twist& parent = twists[joint.parent];
    Twist& child = twists[joint.child];
    child.angular = parent.angular;
    for (std::size_t axis = 0; axis < joint.hinges.size(); ++axis, ++place) {
      const Vector3d along = joint.frame.orientation * Vector3d::Unit(static_cast<Eigen::Index>(axis));
      child.angular += kFastest * (2 * spread(place) - 1) * along;
    }
    const Vector3d& hinge = joint.frame.position;
    child.linear = parent.linear + parent.angular.cross(hinge - robot.links[joint.parent].pose.position) +
                   child.angular.cross(robot.links[joint.child].pose.position - hinge);
  }
  for (std::size_t link = 0; link < robot.links.size(); ++link) {
    world.bodies[link].linear_velocity = twists[link].linear;
    world.bodies[link].angular_velocity = twists[link].angular;
  }
  return world;
}

}  // namespace tessera::robots
