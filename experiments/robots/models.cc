// The ant and the humanoid. Their sizes are about those of the robots of these names that reinforcement
// learning uses; their masses are those of machines.
#include <absl/strings/str_cat.h>

#include <numbers>
#include <string>

#include "experiments/robots/robot.h"

namespace tessera::robots {
namespace {

using Eigen::Vector3d;

std::array<double, 3> inertia_of_box(double mass, const Vector3d& size) {
  const Vector3d s = mass / 12 * size.cwiseAbs2();
  return {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()};
}

// A homogeneous capsule between the middles of its ends.
Link capsule(const std::string& name, const Vector3d& from, const Vector3d& to, double radius, double mass) {
  const double length = (to - from).norm();
  const double in_ends = mass / (1 + 0.75 * length / radius);  // kg
  const double in_middle = mass - in_ends;
  const double r2 = radius * radius;
  const double l2 = length * length;
  const double across =
      in_middle * (l2 / 12 + r2 / 4) + in_ends * (0.4 * r2 + l2 / 4 + 0.375 * length * radius);
  const double along = in_middle * r2 / 2 + in_ends * 0.4 * r2;
  const Pose pose{(from + to) / 2, Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), to - from)};
  return {name, pose, {ShapePart{Capsule{radius, length}, {}}}, mass, {across, across, along}};
}

// The part of a link: a capsule along y.
ShapePart bar(double radius, double length, double height) {
  return {Capsule{radius, length},
          {{0, 0, height}, Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY())}};
}

// A frame of a joint, with its first two axes.
Pose frame_at(const Vector3d& position, const Vector3d& first, const Vector3d& second) {
  Eigen::Matrix3d axes;
  axes << first, second, first.cross(second);
  return {position, Eigen::Quaterniond(axes)};
}

// How long (s) a servo takes to return what is light, without overshooting.
constexpr double kSettle = 0.05;
Hinge servo(double lower, double upper, double middle, double swing, double stiffness) {
  return {lower, upper, stiffness, kSettle * stiffness, middle, swing};
}

class HumanoidBuilder {
 public:
  Robot robot() {
    robot_.name = "humanoid";
    robot_.apart = 3;
    robot_.height = 0.01;
    trunk();
    for (const double side : {-1.0, 1.0}) {
      leg(side);
      arm(side);
    }
    return robot_;
  }

 private:
  static constexpr double kChestHeight = 1.28;
  enum : std::size_t { kChest, kWaist, kPelvis };

  std::size_t add(Link link) {
    robot_.links.push_back(std::move(link));
    return robot_.links.size() - 1;
  }
  void hang(std::size_t child, std::size_t parent, const Pose& frame, std::vector<Hinge> hinges) {
    robot_.joints.push_back({parent, child, frame, std::move(hinges)});
  }

  void trunk() {
    const ShapePart head{Sphere{0.09}, {{0, 0, 0.2}, Eigen::Quaterniond::Identity()}};
    add({"chest",
         {{0, 0, kChestHeight}, Eigen::Quaterniond::Identity()},
         {bar(0.07, 0.14, 0), bar(0.06, 0.12, -0.12), head},
         12,
         inertia_of_box(12, {0.18, 0.28, 0.45})});
    add(capsule("waist", {0, -0.06, 1.03}, {0, 0.06, 1.03}, 0.06, 2.2));
    add(capsule("pelvis", {0, -0.07, 0.9}, {0, 0.07, 0.9}, 0.09, 6));
    hang(kWaist, kChest, frame_at({0, 0, 1.1}, Vector3d::UnitZ(), Vector3d::UnitY()),
         {servo(-0.8, 0.8, 0, 0.2, 300), servo(-1.3, 0.5, -0.1, 0.15, 300)});
    hang(kPelvis, kWaist, frame_at({0, 0, 0.97}, Vector3d::UnitX(), Vector3d::UnitY()),
         {servo(-0.6, 0.6, 0, 0.15, 300)});
  }

  void leg(double side) {
    const std::string name = side < 0 ? "right_" : "left_";
    const auto at = [side](double z) { return Vector3d(0, 0.1 * side, z); };
    const std::size_t hip = add({name + "hip",
                                 {at(0.86), Eigen::Quaterniond::Identity()},
                                 {ShapePart{Sphere{0.05}, {}}},
                                 0.8,
                                 {0.0008, 0.0008, 0.0008}});
    const std::size_t thigh = add(capsule(name + "thigh", at(0.83), at(0.46), 0.06, 4.5));
    const std::size_t shin = add(capsule(name + "shin", at(0.39), at(0.1), 0.049, 2.7));
    const Eigen::Quaterniond ahead = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitX());
    const std::size_t foot = add({name + "foot",
                                  {{0.035, 0.1 * side, 0.03}, Eigen::Quaterniond::Identity()},
                                  {ShapePart{Capsule{0.027, 0.2}, {{0, -0.03, -0.003}, ahead}},
                                   ShapePart{Capsule{0.027, 0.2}, {{0, 0.03, -0.003}, ahead}}},
                                  1,
                                  inertia_of_box(1, {0.26, 0.11, 0.06})});
    hang(hip, kPelvis, frame_at(at(0.86), Vector3d::UnitX(), Vector3d::UnitZ()),
         {servo(-0.5, 0.5, 0, 0.1, 300), servo(-0.7, 0.7, 0, 0.15, 200)});
    hang(thigh, hip, frame_at(at(0.86), Vector3d::UnitY(), Vector3d::UnitX()),
         {servo(-1.9, 0.4, -0.25, 0.3, 300)});
    hang(shin, thigh, frame_at(at(0.42), Vector3d::UnitY(), Vector3d::UnitX()),
         {servo(-0.05, 2.4, 0.45, 0.35, 200)});
    hang(foot, shin, frame_at(at(0.08), Vector3d::UnitY(), Vector3d::UnitX()),
         {servo(-0.8, 0.8, -0.2, 0.2, 100), servo(-0.5, 0.5, 0, 0.1, 100)});
  }

  void arm(double side) {
    const std::string name = side < 0 ? "right_" : "left_";
    const auto at = [side](double z) { return Vector3d(0, 0.2 * side, z); };
    const std::size_t upper = add(capsule(name + "upper_arm", at(1.32), at(1.1), 0.04, 1.6));
    const std::size_t lower = add(capsule(name + "lower_arm", at(1.03), at(0.8), 0.035, 1.2));
    hang(upper, kChest, frame_at(at(1.34), Vector3d::UnitX(), Vector3d::UnitY()),
         {servo(-1.5, 1.5, 0.3 * side, 0.2, 60), servo(-1.5, 1.5, 0, 0.4, 60)});
    hang(lower, upper, frame_at(at(1.06), Vector3d::UnitY(), Vector3d::UnitX()),
         {servo(-2.4, 0.05, -0.6, 0.4, 40)});
  }

  Robot robot_;
};

}  // namespace

Robot ant() {
  constexpr double kTrunk = 0.25;  // m, the radius
  constexpr double kThigh = 0.28;
  constexpr double kShin = 0.56;
  constexpr double kRadius = 0.08;  // of both
  constexpr double kTrunkMass = 10;
  const double moment = 0.4 * kTrunkMass * kTrunk * kTrunk;
  Robot ant;
  ant.name = "ant";
  ant.height = 0.56;
  ant.links.push_back({"trunk", {}, {ShapePart{Sphere{kTrunk}, {}}}, kTrunkMass, {moment, moment, moment}});
  // Shins point down by 55 degrees.
  constexpr double kAcross = 0.573576436351046;  // cosine
  constexpr double kDown = 0.819152044288992;    // sine
  for (int n = 0; n < 4; ++n) {
    const Vector3d way = Vector3d(n == 0 || n == 3 ? 1 : -1, n < 2 ? 1 : -1, 0) * (std::numbers::sqrt2 / 2);
    const Vector3d hip = way * (kTrunk + 0.03);
    const Vector3d knee = hip + way * kThigh;
    const Vector3d foot = knee + kShin * (way * kAcross - Vector3d::UnitZ() * kDown);
    const std::size_t thigh = ant.links.size();
    ant.links.push_back(capsule(absl::StrCat("thigh", n), hip, knee, kRadius, 1));
    ant.links.push_back(capsule(absl::StrCat("shin", n), knee, foot, kRadius, 1.5));
    const Vector3d sideways = Vector3d::UnitZ().cross(way);
    ant.joints.push_back({0, thigh, frame_at(hip, Vector3d::UnitZ(), way), {servo(-0.5, 0.5, 0, 0.35, 200)}});
    // Positive: down.
    ant.joints.push_back(
        {thigh, thigh + 1, frame_at(knee, sideways, way), {servo(-0.45, 0.3, 0, 0.25, 200)}});
  }
  return ant;
}

Robot humanoid() { return HumanoidBuilder().robot(); }

}  // namespace tessera::robots
