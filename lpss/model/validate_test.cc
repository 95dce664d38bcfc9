// What cannot be simulated is refused, with the name of the element and the bound.
#include "lpss/model/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

namespace tessera {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// A box 'good::box' and a floor 'good::floor'.
WorldDescription good_world() {
  WorldDescription world;
  world.name = "good";
  world.shapes = {Shape{{{Box{}, Pose{}}}}, Shape{{{Plane{}, Pose{}}}}};
  BodyDescription box;
  box.name = "good::box";
  BodyDescription floor;
  floor.name = "good::floor";
  floor.properties.motion = Motion::kStatic;
  floor.properties.shape = 1;
  world.bodies = {box, floor};
  return world;
}

ConvexHull tetrahedron() { return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
TriangleMesh triangle() { return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}}; }
HeightField flat() { return {2, 3, {1, 1}, std::vector<double>(6, 0.0)}; }

struct Row {
  std::string name;
  std::function<void(WorldDescription&)> spoil;
  std::vector<std::string> said;  // parts of the message: the element and the bound
  absl::StatusCode code = absl::StatusCode::kInvalidArgument;

  friend void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }
};

// Puts another geometry into the box's shape, on a body that may have it.
std::function<void(WorldDescription&)> shaped(Geometry geometry) {
  return [geometry](WorldDescription& world) {
    world.shapes[0].parts[0].geometry = geometry;
    world.bodies[0].properties.motion = Motion::kStatic;
  };
}

std::function<void(WorldDescription&)> moving(Geometry geometry) {
  return [geometry](WorldDescription& world) { world.shapes[0].parts[0].geometry = geometry; };
}

template <typename Change>
std::function<void(WorldDescription&)> box(Change change) {
  return [change](WorldDescription& world) { change(world.bodies[0]); };
}

template <typename Change>
std::function<void(WorldDescription&)> set(Change change) {
  return [change](WorldDescription& world) { change(world.settings); };
}

std::vector<Row> setting_rows() {
  return {
      {"SectorSizeZero", set([](auto& s) { s.sector_size = 0; }), {"sector_size", "0.5 m"}},
      {"SectorSizeNegative",
       set([](auto& s) { s.sector_size = -128; }),
       {"sector_size = -128 m", "at least 0.5"}},
      {"SectorSizeNan", set([](auto& s) { s.sector_size = kNan; }), {"sector_size", "finite"}},
      {"SectorSizeBreaksFloat",
       set([](auto& s) { s.sector_size = 1024; }),
       {"sector_size = 1024 m", "788.27", "2 r / (3 sqrt(3))", "2048", "0.00012207", "f64"}},
      {"SectorSizeBreaksDouble",
       set([](auto& s) {
         s.precision = Precision::kFloat64;
         s.sector_size = 1e12;
       }),
       {"sector_size = 1e+12 m", "precision f64", "4.2"}},
      {"PrecisionUnknown",
       set([](auto& s) { s.precision = static_cast<Precision>(9); }),
       {"precision = 9", "f32 or f64"}},
      {"SeamsUnknown",
       set([](auto& s) { s.seams = static_cast<SeamPolicy>(9); }),
       {"seams = 9", "island or clone"}},
      {"TimeStepZero", set([](auto& s) { s.time_step = 0; }), {"time_step = 0 s", "1e-05 s"}},
      {"TimeStepNan", set([](auto& s) { s.time_step = kNan; }), {"time_step", "finite"}},
      {"TimeStepLarge", set([](auto& s) { s.time_step = 0.2; }), {"time_step = 0.2 s", "at most 0.1 s"}},
      {"CloneDepthNegative", set([](auto& s) { s.clone_depth = -1; }), {"clone_depth = -1", "at least 0"}},
      {"CloneDepthLarge", set([](auto& s) { s.clone_depth = 9; }), {"clone_depth = 9", "at most 8"}},
      {"SubstepsZero", set([](auto& s) { s.substeps = 0; }), {"substeps = 0", "at least 1"}},
      {"SubstepsTooMany", set([](auto& s) { s.substeps = 65; }), {"substeps = 65", "at most 64"}},
      {"WarmStartingAboveOne",
       set([](auto& s) { s.warm_starting = 1.5; }),
       {"warm_starting = 1.5", "at most 1"}},
      {"SplitFromNegative", set([](auto& s) { s.split_from = -1; }), {"split_from = -1", "at least 0"}},
      {"IterationsZero",
       set([](auto& s) { s.solver_iterations = 0; }),
       {"solver_iterations = 0", "at least 1"}},
      {"IterationsMany",
       set([](auto& s) { s.solver_iterations = 1001; }),
       {"solver_iterations = 1001", "at most 1000"}},
      {"SleepSpeedNegative",
       set([](auto& s) { s.sleep_linear_speed = -1; }),
       {"sleep_linear_speed = -1", "at least 0"}},
      {"SleepSpinNan", set([](auto& s) { s.sleep_angular_speed = kNan; }), {"sleep_angular_speed", "finite"}},
      {"SleepAfterNegative", set([](auto& s) { s.sleep_after = -1; }), {"sleep_after = -1 s", "at least 0"}},
      {"GravityNan",
       set([](auto& s) {
         s.gravity = UniformGravity{{0, kNan, 0}};
       }),
       {"gravity y", "finite"}},
      {"GravityHuge",
       set([](auto& s) {
         s.gravity = UniformGravity{{0, 0, -1e7}};
       }),
       {"gravity = 1e+07 m/s^2", "at most 1e+06"}},
      {"PlanetPullsHuge",
       set([](auto& s) {
         s.gravity = CentralGravity{{}, 1e7, 1};
       }),
       {"central gravity: surface = 1e+07", "at most 1e+06"}},
      {"PlanetRadiusZero",
       set([](auto& s) {
         s.gravity = CentralGravity{{}, 9.8, 0};
       }),
       {"central gravity: radius = 0 m", "at least"}},
      {"PlanetPushes",
       set([](auto& s) {
         s.gravity = CentralGravity{{}, -1, 1};
       }),
       {"central gravity: surface = -1", "at least 0"}},
      {"PlanetNowhere",
       set([](auto& s) {
         s.gravity = CentralGravity{{{}, {0, 0, kInfinite}}, 9.8, 1};
       }),
       {"central gravity: centre z", "finite"}},
      {"PlanetOutOfRange",
       set([](auto& s) {
         s.gravity = CentralGravity{{{std::numeric_limits<std::int64_t>::max(), 0, 0}, {200, 0, 0}}, 9.8, 1};
       }),
       {"central gravity: centre", "64-bit range"},
       absl::StatusCode::kOutOfRange},
  };
}

std::vector<Row> body_rows() {
  return {
      {"NameEmpty", box([](auto& b) { b.name = ""; }), {"name must not be empty"}},
      {"NameLong", box([](auto& b) { b.name.assign(2000, 'x'); }), {"2000 bytes", "1024"}},
      {"NameNotUtf8",
       box([](auto& b) { b.name = "good::b\xf6x"; }),
       {"body 'good::b\\xf6x'", "must be UTF-8"}},
      {"NameTwice", box([](auto& b) { b.name = "good::floor"; }), {"good::floor", "unique"}},
      {"ShapeMissing",
       box([](auto& b) { b.properties.shape = 2; }),
       {"good::box", "shape 2", "below the number of shapes, 2"}},
      {"MotionUnknown",
       box([](auto& b) { b.properties.motion = static_cast<Motion>(7); }),
       {"good::box", "motion = 7"}},
      {"MassZero",
       box([](auto& b) { b.properties.mass = 0; }),
       {"good::box", "mass = 0 kg", "at least 1e-06 kg"}},
      {"MassNegative",
       box([](auto& b) { b.properties.mass = -1; }),
       {"good::box", "mass = -1 kg", "at least 1e-06 kg"}},
      {"MassNan", box([](auto& b) { b.properties.mass = kNan; }), {"good::box", "mass", "finite"}},
      {"MassLarge",
       box([](auto& b) { b.properties.mass = 1e9; }),
       {"good::box", "mass = 1e+09 kg", "at most 1e+06 kg"}},
      {"InertiaZero",
       box([](auto& b) {
         b.properties.inertia = {1, 0, 1};
       }),
       {"good::box", "inertia 1 = 0", "above 0"}},
      {"InertiaTiny",
       box([](auto& b) {
         b.properties.inertia = {1e-40, 1e-40, 1e-40};
       }),
       {"good::box", "inertia 0 = 1e-40 kg m^2", "at least 1e-18"}},
      {"InertiaOfAThread",
       box([](auto& b) {
         b.properties.inertia = {2e-18, 0.215, 0.215};
       }),
       {"good::box", "inertia 0 = 2e-18 kg m^2", "at least 1e-07 of the largest, 0.215"}},
      {"InertiaHuge",
       box([](auto& b) {
         b.properties.inertia = {1e30, 1e30, 1e30};
       }),
       {"good::box", "inertia 0 = 1e+30 kg m^2", "at most 1e+18"}},
      {"InertiaNan",
       box([](auto& b) {
         b.properties.inertia = {1, 1, kNan};
       }),
       {"good::box", "inertia 2", "finite"}},
      {"InertiaTriangle",
       box([](auto& b) {
         b.properties.inertia = {1, 1, 2.1};
       }),
       {"good::box", "2.1 kg m^2", "other two, 2 kg m^2"}},
      {"CentreNan",
       box([](auto& b) {
         b.properties.centre = {0, kNan, 0};
       }),
       {"good::box", "centre of mass y", "finite"}},
      {"AxesNotUnit",
       box([](auto& b) {
         b.properties.principal_axes = {0, 0, 0, 2};
       }),
       {"good::box", "principal axes", "norm 2", "0.001"}},
      {"FrictionNegative",
       box([](auto& b) { b.properties.friction = -0.1; }),
       {"good::box", "friction = -0.1", "at least 0"}},
      {"FrictionInfinite",
       box([](auto& b) { b.properties.friction = kInfinite; }),
       {"good::box", "friction", "finite"}},
      {"RestitutionNegative",
       box([](auto& b) { b.properties.restitution = -0.1; }),
       {"good::box", "restitution = -0.1", "at least 0"}},
      {"RestitutionLarge",
       box([](auto& b) { b.properties.restitution = 1.1; }),
       {"good::box", "restitution = 1.1", "at most 1"}},
      {"DampingLarge",
       box([](auto& b) { b.properties.linear_damping = 1.1; }),
       {"good::box", "linear damping = 1.1", "at most 1"}},
      {"SpinDampingNan",
       box([](auto& b) { b.properties.angular_damping = kNan; }),
       {"good::box", "angular damping", "finite"}},
      {"PoseNan", box([](auto& b) { b.pose.position.local.x() = kNan; }), {"good::box", "pose x", "finite"}},
      {"PoseInfinite",
       box([](auto& b) { b.pose.position.local.z() = -kInfinite; }),
       {"good::box", "pose z", "finite"}},
      {"PoseOutOfRange",
       box([](auto& b) {
         b.pose.position = {{0, std::numeric_limits<std::int64_t>::min(), 0}, {0, -100, 0}};
       }),
       {"good::box", "component j", "64-bit range"},
       absl::StatusCode::kOutOfRange},
      {"QuaternionLong",
       box([](auto& b) {
         b.pose.orientation = {1.01, 0, 0, 0};
       }),
       {"good::box", "norm 1.01", "0.001"}},
      {"QuaternionZero",
       box([](auto& b) {
         b.pose.orientation = {0, 0, 0, 0};
       }),
       {"good::box", "norm 0", "0.001"}},
      {"QuaternionNan",
       box([](auto& b) {
         b.pose.orientation = {kNan, 0, 0, 0};
       }),
       {"good::box", "quaternion", "0.001"}},
      {"VelocityNan",
       box([](auto& b) { b.linear_velocity.y() = kNan; }),
       {"good::box", "linear velocity y", "finite"}},
      {"VelocityLarge",
       box([](auto& b) { b.linear_velocity.y() = 1e7; }),
       {"good::box", "linear velocity = 1e+07 m/s", "1e+06 m/s"}},
      {"SpinLarge",
       box([](auto& b) { b.angular_velocity.y() = 1e6; }),
       {"good::box", "angular velocity", "100000 rad/s"}},
      {"StaticMoves",
       [](auto& w) { w.bodies[1].linear_velocity.x() = 1; },
       {"good::floor", "velocity of a static body"}},
      {"LargerThanSector", moving(Box{{120, 50, 1}}), {"good::box", "130.0", "L = 128 m"}},
      {"KinematicLarger",
       [](auto& w) {
         moving(Sphere{65})(w);
         w.bodies[0].properties.motion = Motion::kKinematic;
       },
       {"good::box", "130 m", "L = 128 m"}},
      {"DynamicPlane", moving(Plane{}), {"good::box", "plane", "static"}},
      {"DynamicMesh", moving(triangle()), {"good::box", "triangle mesh", "static"}},
      {"DynamicHeightField", moving(flat()), {"good::box", "height field", "static"}},
  };
}

template <typename G, typename Change>
std::function<void(WorldDescription&)> with(G geometry, Change change) {
  change(geometry);
  return shaped(geometry);
}

std::vector<Row> shape_rows() {
  return {
      {"NoParts", [](auto& w) { w.shapes[0].parts.clear(); }, {"good::box", "0 parts", "at least 1"}},
      {"ManyParts",
       [](auto& w) {
         w.shapes[0].parts.resize(4097, {Box{}, Pose{}});
       },
       {"good::box", "4097 parts", "at most 4096"}},
      {"PartPoseNan",
       [](auto& w) { w.shapes[0].parts[0].pose.position.x() = kNan; },
       {"good::box", "part 0", "pose x", "finite"}},
      {"PartRotation",
       [](auto& w) {
         w.shapes[0].parts[0].pose.orientation = {2, 0, 0, 0};
       },
       {"good::box", "part 0", "norm 2"}},
      {"BoxZero", shaped(Box{{1, 0, 1}}), {"good::box", "box size y = 0 m", "0.0001 m"}},
      {"BoxNegative", shaped(Box{{1, 1, -1}}), {"good::box", "box size z = -1 m", "0.0001 m"}},
      {"BoxHuge", shaped(Box{{1e9, 1, 1}}), {"good::box", "box size x = 1e+09 m", "at most 1e+08 m"}},
      {"SphereZero", shaped(Sphere{0}), {"sphere radius = 0 m", "0.0001 m"}},
      {"SphereNan", shaped(Sphere{kNan}), {"sphere radius", "finite"}},
      {"CapsuleRadius", shaped(Capsule{-1, 1}), {"capsule radius = -1 m", "0.0001 m"}},
      {"CapsuleLength", shaped(Capsule{1, 0}), {"capsule length = 0 m", "0.0001 m"}},
      {"CylinderRadius", shaped(Cylinder{0, 1}), {"cylinder radius = 0 m", "0.0001 m"}},
      {"CylinderLength", shaped(Cylinder{1, -2}), {"cylinder length = -2 m", "0.0001 m"}},
      {"EllipsoidZero", shaped(Ellipsoid{{1, 1, 0}}), {"ellipsoid radius z = 0 m", "0.0001 m"}},
      {"PlaneNormal", shaped(Plane{{0, 0, 2}}), {"plane normal", "norm 2"}},
      {"PlaneNan", shaped(Plane{{0, 0, kNan}}), {"plane normal"}},
      {"HullFew", shaped(ConvexHull{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}), {"3 points", "at least 4"}},
      {"HullMany", shaped(ConvexHull{std::vector<Eigen::Vector3d>(4097)}), {"4097 points", "at most 4096"}},
      {"HullFlat",
       shaped(ConvexHull{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}}),
       {"in a plane", "0.0001 m"}},
      {"HullLine",
       shaped(ConvexHull{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}}),
       {"in a plane", "0.0001 m"}},
      {"HullNan", with(tetrahedron(), [](auto& h) { h.points[2].y() = kNan; }), {"point 2", "finite"}},
      {"MeshEmpty", shaped(TriangleMesh{}), {"0 indices", "multiple of 3"}},
      {"MeshOdd", with(triangle(), [](auto& m) { m.indices.pop_back(); }), {"2 indices", "multiple of 3"}},
      {"MeshIndex",
       with(triangle(), [](auto& m) { m.indices[1] = 3; }),
       {"index 1 = 3", "number of vertices, 3"}},
      {"MeshNan", with(triangle(), [](auto& m) { m.vertices[1].x() = kNan; }), {"vertex 1", "finite"}},
      {"MeshFar", with(triangle(), [](auto& m) { m.vertices[1].x() = 1e9; }), {"vertex 1", "1e+08 m"}},
      {"FieldNarrow", with(flat(), [](auto& f) { f.columns = 1; }), {"1 x 3", "2 x 2"}},
      {"FieldCount", with(flat(), [](auto& f) { f.heights.pop_back(); }), {"5 heights", "2 x 3 = 6"}},
      {"FieldHuge",
       with(flat(), [](auto& f) { f.columns = f.rows = 4'000'000'000; }),
       {"samples", "100000000"}},
      {"FieldSpacing", with(flat(), [](auto& f) { f.spacing.y() = 0; }), {"spacing y = 0 m", "0.0001 m"}},
      {"FieldNan", with(flat(), [](auto& f) { f.heights[4] = kNan; }), {"height 4", "finite"}},
  };
}

// The good world with a hinge from its floor to its box, 'good::hinge'.
template <typename Change>
std::function<void(WorldDescription&)> hinge(Change change) {
  return [change](WorldDescription& world) {
    JointDescription joint;
    joint.name = "good::hinge";
    joint.properties.type = JointType::kRevolute;
    joint.properties.parent = BodyId{2};
    joint.properties.child = BodyId{1};
    world.joints = {joint};
    change(world.joints[0]);
  };
}

template <typename Change>
std::function<void(WorldDescription&)> axis(Change change) {
  return hinge([change](JointDescription& joint) { change(joint.properties.axes[0]); });
}

std::function<void(WorldDescription&)> driven(DriveMode mode, double target) {
  return hinge([=](JointDescription& joint) { joint.drives[0] = {mode, target}; });
}

std::vector<Row> joint_body_rows() {
  return {
      {"NoName", hinge([](auto& j) { j.name.clear(); }), {"a joint's name must not be empty"}},
      {"LongName", hinge([](auto& j) { j.name.assign(2000, 'x'); }), {"joint 'xxx", "2000 bytes", "1024"}},
      {"TwoOfAName",
       [](WorldDescription& world) {
         hinge([](auto&) {})(world);
         world.joints.push_back(world.joints[0]);
       },
       {"joint 'good::hinge'", "unique"}},
      {"TypeUnknown",
       hinge([](auto& j) { j.properties.type = static_cast<JointType>(9); }),
       {"joint 'good::hinge'", "type = 9", "screw"}},
      {"NoChild", hinge([](auto& j) { j.properties.child = {}; }), {"'good::hinge'", "child = 0", "1 to 2"}},
      {"ChildUnknown", hinge([](auto& j) { j.properties.child.value = 3; }), {"child = 3", "1 to 2"}},
      {"ParentUnknown",
       hinge([](auto& j) { j.properties.parent.value = 3; }),
       {"parent = 3", "0 (the world) to 2"}},
      {"OneBody", hinge([](auto& j) { j.properties.parent.value = 1; }), {"'good::hinge'", "two bodies"}},
      {"ChildStatic",
       hinge([](auto& j) { std::swap(j.properties.parent, j.properties.child); }),
       {"'good::hinge'", "child must be dynamic"}},
      {"FrameNan",
       hinge([](auto& j) { j.properties.in_child.position.y() = kNan; }),
       {"'good::hinge'", "in_child y", "finite"}},
      {"FrameNotUnit",
       hinge([](auto& j) { j.properties.in_parent.orientation.w() = 2; }),
       {"'good::hinge'", "in_parent", "norm 2"}},
      {"FrameFarFromBody",
       hinge([](auto& j) { j.properties.in_child.position.z() = 129; }),
       {"in_child", "129 m", "128 m"}},
      {"FramesApart",
       hinge([](auto& j) { j.properties.in_parent.position.z() = 129; }),
       {"129 m apart", "L = 128 m"}},
      {"PlaceOutOfRange",
       hinge([](auto& j) {
         j.properties.parent = {};
         j.properties.anchor.k = std::numeric_limits<std::int64_t>::max();
         j.properties.in_parent.position.z() = 100;
       }),
       {"'good::hinge'", "in_parent"},
       absl::StatusCode::kOutOfRange},
  };
}

std::vector<Row> joint_axis_rows() {
  return {
      {"LimitsCrossed",
       axis([](auto& a) { a = {.lower = 1, .upper = -1}; }),
       {"'good::hinge': axis 1", "lower = 1 rad", "upper = -1 rad"}},
      {"LimitNan", axis([](auto& a) { a.upper = kNan; }), {"axis 1", "numbers"}},
      {"LimitInfinite", axis([](auto& a) { a.lower = kInfinite; }), {"axis 1", "lower = inf"}},
      {"LimitBeyondHalfATurn", axis([](auto& a) { a.lower = -4; }), {"limit = -4 rad", "[-pi, pi]"}},
      {"VelocityZero", axis([](auto& a) { a.velocity_max = 0; }), {"velocity_max = 0 rad/s", "above 0"}},
      {"EffortNegative", axis([](auto& a) { a.effort_max = -1; }), {"effort_max = -1", "at least 0"}},
      {"DampingNegative", axis([](auto& a) { a.damping = -1; }), {"damping = -1", "at least 0"}},
      {"FrictionNan", axis([](auto& a) { a.friction = kNan; }), {"friction", "finite"}},
      {"PitchZero",
       hinge([](auto& j) { j.properties.type = JointType::kScrew; }),
       {"'good::hinge'", "pitch = 0 m/rad"}},
      {"PitchNanOfNoScrew",
       hinge([](auto& j) { j.properties.pitch = kNan; }),
       {"'good::hinge'", "pitch = nan m/rad", "finite"}},
      {"DriveFreeNan", driven(DriveMode::kFree, kNan), {"drive of axis 1", "target = nan", "finite"}},
      {"DriveUnknown", driven(static_cast<DriveMode>(7), 0), {"drive of axis 1", "mode = 7"}},
      {"DriveNan", driven(DriveMode::kVelocity, kNan), {"drive of axis 1", "velocity", "finite"}},
      {"DriveBeyondHalfATurn", driven(DriveMode::kPosition, 4), {"position = 4 rad", "3.14159 rad"}},
      {"DriveTooFar",
       hinge([](auto& j) {
         j.properties.type = JointType::kPrismatic;
         j.drives[0] = {DriveMode::kPosition, 1e308};
       }),
       {"drive of axis 1", "position = 1e+308 m", "1e+06 m"}},
      {"DriveOfNoAxis",
       hinge([](auto& j) { j.drives[1].mode = DriveMode::kVelocity; }),
       {"drive of axis 2", "1 axes"}},
  };
}

class Refused : public testing::TestWithParam<Row> {};

TEST_P(Refused, WithElementAndBound) {
  WorldDescription world = good_world();
  GetParam().spoil(world);
  const absl::Status status = validate(world);
  EXPECT_EQ(status.code(), GetParam().code) << status;
  for (const std::string& part : GetParam().said) EXPECT_THAT(std::string(status.message()), HasSubstr(part));
}

std::string row_name(const testing::TestParamInfo<Row>& row) { return row.param.name; }

INSTANTIATE_TEST_SUITE_P(Settings, Refused, testing::ValuesIn(setting_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Bodies, Refused, testing::ValuesIn(body_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(Shapes, Refused, testing::ValuesIn(shape_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(JointBodies, Refused, testing::ValuesIn(joint_body_rows()), row_name);
INSTANTIATE_TEST_SUITE_P(JointAxes, Refused, testing::ValuesIn(joint_axis_rows()), row_name);

TEST(Accepted, TheGoodWorld) { EXPECT_TRUE(validate(good_world()).ok()) << validate(good_world()); }

TEST(Accepted, EveryGeometryOnAStaticBody) {
  for (const Geometry& geometry :
       std::vector<Geometry>{Box{}, Sphere{}, Capsule{}, Cylinder{}, Ellipsoid{}, Plane{}, tetrahedron(),
                             triangle(), flat(), Box{{1000, 1000, 1}}}) {
    WorldDescription world = good_world();
    shaped(geometry)(world);
    EXPECT_TRUE(validate(world).ok()) << validate(world);
  }
}

TEST(Accepted, RoundedInertiaOfAPlate) {
  WorldDescription world = good_world();
  world.bodies[0].properties.inertia = {0.0166, 0.0166, 0.03321};
  EXPECT_TRUE(validate(world).ok()) << validate(world);
}

TEST(Accepted, AKinematicBody) {
  WorldDescription world = good_world();
  world.bodies[0].properties.motion = Motion::kKinematic;
  world.bodies[0].properties.mass = 0;
  world.bodies[0].linear_velocity = {1, 0, 0};
  EXPECT_TRUE(validate(world).ok()) << validate(world);
}

TEST(Accepted, JointsToBodiesAndToTheWorld) {
  WorldDescription world = good_world();
  hinge([](auto& j) { j.properties.axes[0].lower = 0; })(world);
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  world.joints[0].properties.in_parent.position.x() = 100;  // of a static body: may be large
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  world.joints[0].properties.parent = {};
  world.joints[0].properties.anchor.i = -1;
  world.joints[0].properties.in_parent.position.x() = 128;
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  world.joints[0].properties.type = JointType::kPrismatic;
  world.joints[0].properties.axes[0] = {.lower = -10, .upper = 10};
  EXPECT_TRUE(validate(world).ok()) << validate(world);
}

TEST(Accepted, TriggersWithoutClonesThatAreSolved) {
  WorldDescription world = good_world();
  world.bodies[0].properties.trigger = true;
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  world.settings.seams = SeamPolicy::kClone;
  const std::string refusal =
      "body 'good::box': a trigger needs the seam policy island; that of the world is clone";
  EXPECT_EQ(validate(world).message(), refusal);
  world.bodies[0].properties.trigger = false;
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  world.shapes[0].parts[0].material = PartMaterial{};
  world.shapes[0].parts[0].material->trigger = true;
  EXPECT_EQ(validate(world).message(), refusal);
}

TEST(Accepted, NoClonesAtAll) {
  WorldDescription world = good_world();
  world.settings.clone_depth = 0;
  EXPECT_TRUE(validate(world).ok()) << validate(world);
}

TEST(Accepted, TheEndsOfTheRange) {
  WorldDescription world = good_world();
  world.bodies[0].pose.position.sector = {std::numeric_limits<std::int64_t>::max(),
                                          std::numeric_limits<std::int64_t>::min(), std::int64_t{1} << 62};
  EXPECT_TRUE(validate(world).ok()) << validate(world);
}

// At r / (1.5 sqrt(3)), the farthest corner of the 26 neighbours is r away.
TEST(PrecisionLimit, IsWhereNumbersGetTooCoarse) {
  const double r32 = 1.5 * std::sqrt(3.0) * precision_limit(Precision::kFloat32);
  EXPECT_NEAR(r32, 2048, 1e-9);
  const float below = std::nextafter(2048.0f, 0.0f);
  EXPECT_EQ(2048.0f - below, kResolutionWanted);
  EXPECT_GT(std::nextafter(2048.0f, INFINITY) - 2048.0f, kResolutionWanted);
  const double r64 = 1.5 * std::sqrt(3.0) * precision_limit(Precision::kFloat64);
  EXPECT_NEAR(r64 / std::ldexp(1.0, 40), 1, 1e-12);
}

TEST(PrecisionLimit, DecidesWhichSectorSizesPass) {
  const auto passes = [](Precision precision, double sector_size) {
    WorldSettings settings;
    settings.precision = precision;
    settings.sector_size = sector_size;
    return validate(settings).ok();
  };
  for (double sector_size : {0.5, 8.0, 128.0, 512.0, 788.0})
    EXPECT_TRUE(passes(Precision::kFloat32, sector_size));
  for (double sector_size : {789.0, 1024.0, 1e6}) EXPECT_FALSE(passes(Precision::kFloat32, sector_size));
  for (double sector_size : {0.5, 128.0, 1024.0, 1e6, 4e11})
    EXPECT_TRUE(passes(Precision::kFloat64, sector_size));
}

TEST(MoveBy, MovesBodiesPlanetAndAnchor) {
  WorldDescription world = good_world();
  world.settings.gravity = CentralGravity{{{0, 0, -1}, {1, 2, 3}}, 9.8, 100};
  const SectorOffset offset{std::int64_t{1} << 62, -5, 7};
  ASSERT_TRUE(move_by(world, offset).ok());
  const SectorIndex moved{offset.i, offset.j, offset.k};
  EXPECT_EQ(world.anchor, moved);
  for (const BodyDescription& body : world.bodies) EXPECT_EQ(body.pose.position.sector, moved);
  EXPECT_EQ(std::get<CentralGravity>(world.settings.gravity).centre.sector, (SectorIndex{offset.i, -5, 6}));
  EXPECT_TRUE(validate(world).ok());
}

TEST(MoveBy, MovesJointsToTheWorld) {
  WorldDescription world = good_world();
  hinge([](auto&) {})(world);
  ASSERT_TRUE(move_by(world, {1, 2, 3}).ok());
  EXPECT_EQ(world.joints[0].properties.anchor, SectorIndex{});
  JointProperties& joint = world.joints[0].properties;
  joint = {};
  joint.type = JointType::kBall;
  joint.child = BodyId{1};
  joint.anchor = {1, 2, 3};
  ASSERT_TRUE(move_by(world, {1, 2, 3}).ok());
  EXPECT_EQ(world.joints[0].properties.anchor, (SectorIndex{2, 4, 6}));
  world.joints[0].properties.anchor.i = std::numeric_limits<std::int64_t>::max();
  const absl::Status status = move_by(world, {1, 0, 0});
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(status.message()), HasSubstr("joint 'good::hinge'"));
}

TEST(MoveBy, RefusesToLeaveTheRangeAndChangesNothing) {
  WorldDescription world = good_world();
  world.bodies[1].pose.position.sector.j = std::int64_t{1} << 62;
  const absl::Status status = move_by(world, {0, std::int64_t{1} << 62, 0});
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(status.message()), HasSubstr("good::floor"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("component j"));
  EXPECT_EQ(world.anchor, SectorIndex{});
  EXPECT_EQ(world.bodies[0].pose.position.sector, SectorIndex{});
}

TEST(MoveBy, RefusesForAnchorAndPlanet) {
  WorldDescription world = good_world();
  world.anchor.i = std::numeric_limits<std::int64_t>::max();
  EXPECT_THAT(std::string(move_by(world, {1, 0, 0}).message()), HasSubstr("anchor"));
  world.anchor.i = 0;
  world.settings.gravity =
      CentralGravity{{{0, 0, std::numeric_limits<std::int64_t>::min()}, {0, 0, 0}}, 9.8, 100};
  EXPECT_THAT(std::string(move_by(world, {0, 0, -1}).message()), HasSubstr("central gravity"));
}

}  // namespace
}  // namespace tessera
