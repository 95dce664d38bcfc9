#include "experiments/joints/on_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "experiments/lowest_point.h"
#include "lpss/base/invariant.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera::models {
namespace {

using Eigen::Vector3d;

constexpr double kFriction = 1;
constexpr double kSpeed = 0.3;       // m/s
constexpr double kStartingTime = 1;  // s: wheels have their speed
constexpr double kDrivingTime = 3;   // s, after that
constexpr double kTouch = 0.01;      // m above the plane: a wheel that touches it, or nearly
constexpr double kStraight = 0.99;   // cosine, of directions that are taken as one
constexpr double kSettle = 0.02;     // s, in which a servo takes back an error

const Vector3d kUp = Vector3d::UnitZ();

// m: of what turns about `axis` (through `centre`, unit length, in the body frame); 0 where that is not
// round.
double wheel_radius(const Shape& shape, const Vector3d& centre, const Vector3d& axis) {
  double radius = 0;
  for (const ShapePart& part : shape.parts) {
    const Vector3d along = part.pose.orientation.conjugate() * axis;
    const Vector3d off = part.pose.position - centre;
    if ((off - off.dot(axis) * axis).norm() > 1e-3) return 0;
    if (const auto* cylinder = std::get_if<Cylinder>(&part.geometry)) {
      if (std::abs(along.z()) < kStraight) return 0;
      radius = std::max(radius, cylinder->radius);
    } else if (const auto* ball = std::get_if<Sphere>(&part.geometry)) {
      radius = std::max(radius, ball->radius);
    } else if (const auto* hull = std::get_if<ConvexHull>(&part.geometry)) {
      for (const Vector3d& point : hull->points)
        radius = std::max(radius, (point - point.dot(along) * along).norm());
    } else {
      return 0;
    }
  }
  return radius;
}

struct Wheel {
  JointId joint;
  BodyId body;
  double radius = 0;     // m
  double direction = 1;  // of the drive
  Vector3d centre;       // in its body frame, likewise
  Vector3d axis;
  double angle = 0;  // rad, turned so far in the world: a trunk may pitch
};

class Robot {
 public:
  explicit Robot(WorldDescription world) : world_(std::move(world)) {
    for (const BodyDescription& body : world_.bodies) mass_ += body.properties.mass;
    set_down();
    find_wheels();
    hold_joints();
  }

  const WorldDescription& world() const { return world_; }
  std::vector<Wheel>& wheels() { return wheels_; }

  Pose pose(const BodyRecord& record) const {
    return pose_of(body_pose(record, world_.settings.sector_size));
  }
  const Shape& shape(BodyId id) const { return world_.shapes[world_.bodies[id.value - 1].properties.shape]; }

 private:
  Pose pose_of(const WorldPose& pose) const {
    return {relative_to(pose.position, world_.anchor, world_.settings.sector_size), pose.orientation};
  }

  void set_down() {
    double lowest = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < world_.bodies.size(); ++n)
      lowest = std::min(lowest, lowest_point(shape(BodyId{n + 1}), pose_of(world_.bodies[n].pose)));
    if (!std::isfinite(lowest)) lowest = 0;
    for (BodyDescription& body : world_.bodies) {
      const absl::StatusOr<WorldPosition> place = canonical(
          body.pose.position.sector, body.pose.position.local - lowest * kUp, world_.settings.sector_size);
      invariant(place.ok(), "a robot is near its anchor");
      body.pose.position = *place;
    }
    BodyDescription ground;
    ground.name = "the plane that it stands on";
    ground.properties.motion = Motion::kStatic;
    ground.properties.shape = world_.shapes.size();
    ground.properties.friction = kFriction;
    ground.pose.position.sector = world_.anchor;
    world_.shapes.push_back(Shape{{ShapePart{Plane{}, {}}}});
    world_.bodies.push_back(std::move(ground));
  }

  // As the fork of a caster does; what is fixed, or slides as on a suspension, does not.
  bool turns(BodyId id) const {
    return std::ranges::any_of(world_.joints, [&](const JointDescription& joint) {
      return joint.properties.child == id && turns(joint.properties.type);
    });
  }
  static bool turns(JointType type) { return type != JointType::kFixed && type != JointType::kPrismatic; }
  bool has_children(BodyId id) const {
    return std::ranges::any_of(world_.joints,
                               [&](const JointDescription& joint) { return joint.properties.parent == id; });
  }

  // Turns without end about a level axis, is round, and touches the plane.
  void find_wheels() {
    for (std::size_t n = 0; n < world_.joints.size(); ++n) {
      const JointProperties& joint = world_.joints[n].properties;
      if (joint.type != JointType::kRevolute || std::isfinite(joint.axes[0].lower)) continue;
      const BodyDescription& body = world_.bodies[joint.child.value - 1];
      const Vector3d in_body = joint.in_child.orientation * Vector3d::UnitX();
      const Vector3d axis = body.pose.orientation * in_body;
      const double radius = wheel_radius(shape(joint.child), joint.in_child.position, in_body);
      if (radius == 0 || std::abs(axis.z()) > 0.1 || has_children(joint.child) ||
          lowest_point(shape(joint.child), pose_of(body.pose)) > kTouch)
        continue;
      is_wheel_.push_back(joint.child);
      // Those of casters are not driven.
      if (turns(joint.parent)) continue;
      const Vector3d ahead = axis.cross(kUp);
      if (wheels_.empty()) ahead_ = ahead.normalized();
      const double along = ahead.normalized().dot(ahead_);
      if (std::abs(along) < kStraight) is_straight_ = false;
      wheels_.push_back(
          {JointId{n + 1}, joint.child, radius, along < 0 ? -1.0 : 1.0, joint.in_child.position, in_body});
    }
    // Wheels in several directions do not drive straight on.
    if (!is_straight_ || wheels_.size() < 2) wheels_.clear();
  }

  bool turns_freely(const JointProperties& joint) const {
    if (std::ranges::find(is_wheel_, joint.child) != is_wheel_.end()) return true;
    // What a caster turns on.
    return turns(joint.type) && std::ranges::any_of(world_.joints, [&](const JointDescription& other) {
             return other.properties.parent == joint.child &&
                    std::ranges::find(is_wheel_, other.properties.child) != is_wheel_.end();
           });
  }

  // With a stiffness at which the whole weight on a lever of 1 m moves an axis by a thousandth.
  void hold_joints() {
    const double stiffness = 1000 * mass_ * 9.81;
    for (JointDescription& joint : world_.joints) {
      if (axis_count(joint.properties.type) == 0 || turns_freely(joint.properties)) continue;
      const auto frame = [&](BodyId id, const Pose& in_body) {
        return id == BodyId{} ? in_body : pose_of(world_.bodies[id.value - 1].pose) * in_body;
      };
      const std::array<double, 2> position =
          joint_position(joint.properties.type, frame(joint.properties.parent, joint.properties.in_parent),
                         frame(joint.properties.child, joint.properties.in_child));
      for (int axis = 0; axis < axis_count(joint.properties.type); ++axis)
        joint.drives[axis] = {DriveMode::kServo, position[axis], stiffness, stiffness * kSettle, 0, 0};
    }
  }

  WorldDescription world_;
  std::vector<Wheel> wheels_;
  std::vector<BodyId> is_wheel_;  // all wheels, driven or not
  Vector3d ahead_ = Vector3d::UnitX();
  bool is_straight_ = true;
  double mass_ = 0;
};

// A robot on its plane, as it runs.
class Run {
 public:
  Run(Robot& robot, PartitionCluster& cluster) : robot_(robot), cluster_(cluster) {}

  void stand() {
    for (Tick tick = 0; tick < ticks_in(kStandingTime); ++tick) step({});
    result_.lowest = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n + 1 < robot_.world().bodies.size(); ++n) {
      const BodyId id{n + 1};
      const absl::StatusOr<BodyRecord> record = cluster_.body(id);
      if (record.ok())
        result_.lowest = std::min(result_.lowest, lowest_point(robot_.shape(id), robot_.pose(*record)));
    }
  }

  void drive() {
    result_.wheels = static_cast<int>(robot_.wheels().size());
    if (robot_.wheels().empty()) return;
    std::vector<Command> start;
    for (const Wheel& wheel : robot_.wheels()) {
      const JointDrive drive{DriveMode::kVelocity, wheel.direction * kSpeed / wheel.radius};
      start.emplace_back(SetDrives{wheel.joint, {drive, {}}});
    }
    step(start);
    for (Tick tick = 1; tick < ticks_in(kStartingTime); ++tick) step({});
    const Vector3d begin = middle();
    for (Wheel& wheel : robot_.wheels()) wheel.angle = 0;
    for (Tick tick = 0; tick < ticks_in(kDrivingTime); ++tick) step({});
    double rolled = 0;  // m
    for (const Wheel& wheel : robot_.wheels()) rolled += wheel.direction * wheel.angle * wheel.radius;
    rolled /= static_cast<double>(robot_.wheels().size());
    const Vector3d way = middle() - begin;
    result_.wheel_way = way.head<2>().norm() / rolled;
  }

  const OnPlane& result() const { return result_; }

 private:
  Tick ticks_in(double seconds) const {
    return static_cast<Tick>(std::llround(seconds / robot_.world().settings.time_step));
  }

  void step(const std::vector<Command>& commands) {
    cluster_.step(commands);
    result_.diverged = result_.diverged || cluster_.counts().diverged > 0;
    for (Wheel& wheel : robot_.wheels()) {
      const BodyRecord body = cluster_.body(wheel.body).value();
      const Vector3d spin(body.state.angular_velocity.data());
      const Vector3d axis = robot_.pose(body).orientation * wheel.axis;
      wheel.angle += axis.dot(spin) * robot_.world().settings.time_step;
    }
  }

  // Of the centres of all wheels.
  Vector3d middle() {
    Vector3d sum = Vector3d::Zero();
    for (const Wheel& wheel : robot_.wheels())
      sum += robot_.pose(cluster_.body(wheel.body).value()) * wheel.centre;
    return sum / static_cast<double>(robot_.wheels().size());
  }

  Robot& robot_;
  PartitionCluster& cluster_;
  OnPlane result_;
};

}  // namespace

bool is_robot(const WorldDescription& world) {
  return !world.joints.empty() && std::ranges::none_of(world.bodies, [](const BodyDescription& body) {
    return body.properties.motion != Motion::kDynamic;
  }) && std::ranges::none_of(world.joints, [](const JointDescription& joint) {
    return joint.properties.parent == BodyId{};
  });
}

absl::StatusOr<OnPlane> set_on_plane(WorldDescription world) {
  world.settings.sleep_after = 0;
  Robot robot(std::move(world));
  const absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster =
      PartitionCluster::create(robot.world(), 1);
  if (!cluster.ok()) return cluster.status();
  Run run(robot, **cluster);
  run.stand();
  run.drive();
  return run.result();
}

}  // namespace tessera::models
