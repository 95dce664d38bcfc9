#include "proto/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lpss/model/validate.h"
#include "lpss/programs/registry.h"
#include "proto/convert_counts.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr double kThird = 1.0 / 3;

Ground some_ground() {
  return {.source = Ground::Source::kFolder,
          .spacing = kThird,
          .radius = 1,
          .height = 2,
          .wavelength = 3,
          .octaves = 4,
          .seed = 5,
          .has_sea = true,
          .folder = "here",
          .edge = 6,
          .low = -7,
          .checksum = ~std::uint64_t{0}};
}

Shape every_geometry() {
  Shape shape;
  const Pose pose{{1, -2, kThird}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
  shape.parts = {{Box{{1, 2, 3}}, pose},
                 {Sphere{kThird}, pose},
                 {Capsule{0.1, 0.2}, {}},
                 {Cylinder{0.3, 0.4}, {}},
                 {Ellipsoid{{1, 2, 3}}, {}},
                 {Plane{{0, 1, 0}}, {}},
                 {ConvexHull{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, {}},
                 {TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}}, {}},
                 {HeightField{2, 2, {0.5, 0.25}, {1, 2, 3, 4}}, {}},
                 {some_ground(), {}}};
  return shape;
}

BodyDescription some_body() {
  BodyDescription body;
  body.name = "model::link";
  body.properties.motion = Motion::kKinematic;
  body.properties.shape = 0;
  body.properties.mass = kThird;
  body.properties.inertia = {1, 2, 2.5};
  body.properties.centre = {-0.0, 0.1, std::numeric_limits<double>::denorm_min()};
  body.properties.principal_axes = {0.5, 0.5, 0.5, 0.5};
  body.properties.friction = 0.1;
  body.properties.restitution = 0.2;
  body.properties.linear_damping = 0.3;
  body.properties.angular_damping = 0.4;
  body.properties.category = 0x80000000;
  body.properties.mask = 0xfffffffe;
  body.properties.gravity = false;
  body.properties.assembly = 5;
  body.properties.trigger = true;
  body.properties.surface = Surface{{kThird, 0, -0.0}, 0.1, 0.2, 0.3, 0.4, {5, 6, 7}, {8, 9, 10}};
  body.pose.position = {
      {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(), -1},
      {kThird, -64, 63.5}};
  body.pose.orientation = Eigen::Quaterniond(kThird, 0.1, 0.2, 0.3);
  body.linear_velocity = {1, -0.0, 3};
  body.angular_velocity = {4, 5, 6};
  return body;
}

JointDescription some_joint() {
  JointDescription joint;
  joint.name = "model::joint";
  joint.properties.type = JointType::kUniversal;
  joint.properties.parent = BodyId{2};
  joint.properties.child = BodyId{1};
  joint.properties.anchor = {1, 2, std::numeric_limits<std::int64_t>::max()};
  joint.properties.in_parent = {{kThird, -0.0, 1}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
  joint.properties.in_child.position = {4, 5, 6};
  joint.properties.axes[0] = {-1, 0, 2, 0, kThird, 0.5, 6, -kThird, 7, {JointId{2}, 0, kThird, 3, -4}};
  joint.properties.axes[1].lower = 0;
  joint.properties.bodies_collide = true;
  joint.drives = {JointDrive{DriveMode::kPosition, kThird},
                  JointDrive{DriveMode::kServo, -1, 2, 3, 4, kThird}};
  return joint;
}

JointDescription some_screw() {
  JointDescription joint;
  joint.name = "screw";
  joint.properties.type = JointType::kScrew;
  joint.properties.child = BodyId{1};
  joint.properties.pitch = -0.002;
  return joint;
}

WorldDescription some_world() {
  WorldDescription world;
  world.name = "world";
  world.settings.precision = Precision::kFloat64;
  world.settings.sector_size = 100;
  world.settings.time_step = 0.001;
  world.settings.seams = SeamPolicy::kClone;
  world.settings.clone_depth = 3;
  world.settings.gravity = CentralGravity{{{1, 2, 3}, {4, 5, 6}}, 9.8, 6.4e6};
  world.settings.solver_iterations = 20;
  world.settings.friction_in_two_directions = false;
  world.settings.continuous_collision = false;
  world.settings.sleep_after = 0;
  world.settings.adapt = false;
  world.settings.shuffle = 0xfedcba9876543210;
  world.anchor = {1, std::int64_t{1} << 62, -5};
  world.shapes = {every_geometry(), Shape{{{Sphere{1}, {}}}}};
  world.bodies = {some_body(), BodyDescription{.name = "plain"}};
  world.joints = {some_joint(), some_screw()};
  world.frames = {{"model::frame", 1, {{1, kThird, -0.0}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)}}};
  return world;
}

// What went through proto and back is the same message again, byte for byte, and so are its fields.
TEST(Convert, AWorldSurvivesBitForBit) {
  const WorldDescription world = some_world();
  const v1::World message = to_proto(world);
  v1::World received;
  ASSERT_TRUE(received.ParseFromString(message.SerializeAsString()));
  const absl::StatusOr<WorldDescription> back = from_proto(received);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(to_proto(*back).SerializeAsString(), message.SerializeAsString());

  ASSERT_EQ(back->frames.size(), 1u);
  EXPECT_EQ(back->frames[0].name, "model::frame");
  EXPECT_EQ(back->frames[0].body, 1u);
  EXPECT_EQ(back->frames[0].pose.position, world.frames[0].pose.position);
  EXPECT_EQ(back->name, world.name);
  EXPECT_EQ(back->anchor, world.anchor);
  EXPECT_EQ(back->settings.precision, Precision::kFloat64);
  EXPECT_EQ(back->settings.seams, SeamPolicy::kClone);
  EXPECT_EQ(std::get<CentralGravity>(back->settings.gravity).centre, (WorldPosition{{1, 2, 3}, {4, 5, 6}}));
  const BodyDescription& body = back->bodies[0];
  EXPECT_EQ(body.pose.position, world.bodies[0].pose.position);
  EXPECT_EQ(body.pose.orientation.coeffs(), world.bodies[0].pose.orientation.coeffs());
  EXPECT_TRUE(std::signbit(body.linear_velocity.y()));
  EXPECT_TRUE(std::signbit(body.properties.centre[0]));
  EXPECT_EQ(body.properties.centre[2], std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(body.properties.principal_axes, world.bodies[0].properties.principal_axes);
  EXPECT_EQ(body.properties.motion, Motion::kKinematic);
  EXPECT_EQ(body.properties.mask, 0xfffffffeu);
  EXPECT_FALSE(body.properties.gravity);
  EXPECT_TRUE(back->bodies[1].properties.gravity);
}

// A message has those that differ from the first ones.
TEST(Convert, ProgramsSurviveBitForBit) {
  ProgramRecord record = *new_program("character");
  record.name = "walker";
  ASSERT_TRUE(set_number(record, "x", -0.0).ok() && set_number(record, "y", kThird).ok());
  const absl::StatusOr<ProgramRecord> back = from_proto(to_proto(record));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->name, "walker");
  EXPECT_EQ(back->inputs, record.inputs);
  EXPECT_EQ(back->parameters, record.parameters);
  EXPECT_TRUE(std::signbit(back->inputs[0]));
}

TEST(Convert, JointsSurviveBitForBit) {
  const WorldDescription world = some_world();
  const absl::StatusOr<WorldDescription> back = from_proto(to_proto(world));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->settings.shuffle, 0xfedcba9876543210u);
  EXPECT_EQ(back->bodies[0].properties.assembly, 5u);
  EXPECT_TRUE(back->bodies[0].properties.trigger);
  ASSERT_EQ(back->joints.size(), 2u);
  const JointDescription& joint = back->joints[0];
  EXPECT_EQ(joint.name, "model::joint");
  EXPECT_EQ(joint.properties.type, JointType::kUniversal);
  EXPECT_EQ(joint.properties.parent, BodyId{2});
  EXPECT_EQ(joint.properties.anchor, world.joints[0].properties.anchor);
  EXPECT_EQ(joint.properties.in_parent.orientation.coeffs(),
            world.joints[0].properties.in_parent.orientation.coeffs());
  EXPECT_TRUE(std::signbit(joint.properties.in_parent.position.y()));
  const JointAxis& first = joint.properties.axes[0];
  EXPECT_EQ((std::array{first.lower, first.upper, first.velocity_max, first.effort_max, first.damping}),
            (std::array{-1.0, 0.0, 2.0, 0.0, kThird}));
  EXPECT_EQ(first.spring_stiffness, 6);
  EXPECT_EQ(first.spring_reference, -kThird);
  EXPECT_EQ(first.armature, 7);
  EXPECT_EQ(first.mimic.leader, JointId{2});
  EXPECT_EQ((std::array{first.mimic.multiplier, first.mimic.reference, first.mimic.offset}),
            (std::array{kThird, 3.0, -4.0}));
  EXPECT_EQ(joint.properties.axes[1].lower, 0);
  EXPECT_EQ(joint.properties.axes[1].upper, kUnbounded);
  EXPECT_TRUE(joint.properties.bodies_collide);
  EXPECT_EQ(joint.drives, world.joints[0].drives);
  EXPECT_EQ(back->joints[1].properties.parent, BodyId{});
  EXPECT_EQ(back->joints[1].properties.pitch, -0.002);
}

TEST(Convert, WhatAJointLeavesOutIsFree) {
  v1::Joint message;
  message.mutable_properties()->set_type(v1::JOINT_REVOLUTE);
  const absl::StatusOr<JointDescription> joint = from_proto(message);
  ASSERT_TRUE(joint.ok()) << joint.status();
  EXPECT_EQ(joint->properties.axes[0].lower, -kUnbounded);
  EXPECT_EQ(joint->properties.axes[0].effort_max, kUnbounded);
  EXPECT_EQ(joint->drives, JointDrives{});
  EXPECT_TRUE(joint->properties.in_child.is_identity());
}

TEST(Convert, FramesThatMoveSurvive) {
  WorldSettings settings;
  settings.frames.resize(2);
  MovingFrame& station = settings.frames[0];
  station.name = "station";
  station.start = {{{1, -2, 3}, {0.5, kThird, -4}}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
  station.velocity = {7.7e3, kThird, 0};
  station.spin = {0, 0, 1e-3};
  station.falls = true;
  station.region = FrameRegion{{1, 2, 3}, {4, 5, 6}};
  MovingFrame& train = settings.frames[1];
  train.name = "train";
  train.legs = {{2, {0, kThird, 0}}, {kThird, {1, 0, 0}}};
  train.carrier = FrameCarrier{BodyId{7}, {{1, kThird, 3}, Eigen::Quaterniond(0.5, 0.5, 0.5, -0.5)}};
  const absl::StatusOr<WorldSettings> back = from_proto(to_proto(settings));
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->frames.size(), 2u);
  const MovingFrame& first = back->frames[0];
  EXPECT_EQ(first.name, station.name);
  EXPECT_EQ(first.start.position, station.start.position);
  EXPECT_EQ(first.start.orientation.coeffs(), station.start.orientation.coeffs());
  EXPECT_EQ(first.velocity, station.velocity);
  EXPECT_EQ(first.spin, station.spin);
  EXPECT_TRUE(first.falls);
  EXPECT_FALSE(first.carrier.has_value());
  ASSERT_TRUE(first.region.has_value());
  EXPECT_EQ(first.region->centre, station.region->centre);
  EXPECT_EQ(first.region->size, station.region->size);
  const MovingFrame& second = back->frames[1];
  EXPECT_FALSE(second.falls);
  EXPECT_FALSE(second.region.has_value());
  ASSERT_EQ(second.legs.size(), 2u);
  EXPECT_EQ(second.legs[1].seconds, kThird);
  EXPECT_EQ(second.legs[0].acceleration, train.legs[0].acceleration);
  ASSERT_TRUE(second.carrier.has_value());
  EXPECT_EQ(second.carrier->body, train.carrier->body);
  EXPECT_EQ(second.carrier->pose.position, train.carrier->pose.position);
  EXPECT_EQ(second.carrier->pose.orientation.coeffs(), train.carrier->pose.orientation.coeffs());
}

TEST(Convert, KeysOfFramesSurviveAndGetTheVelocitiesThatTheyLack) {
  WorldSettings settings;
  settings.frames.resize(1);
  settings.frames[0].name = "tram";
  settings.frames[0].loops = true;
  const Eigen::Quaterniond turned(0.5, 0.5, -0.5, 0.5);
  settings.frames[0].keys = {{0, {}, Eigen::Vector3d(kThird, 0, 0), {}},
                             {kThird, {{1, kThird, 3}, turned}, {}, Eigen::Vector3d(0, kThird, 0)},
                             {2, {}, {}, {}}};
  const absl::StatusOr<WorldSettings> back = from_proto(to_proto(settings));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_TRUE(validate(*back).ok()) << validate(*back);
  const MovingFrame& frame = back->frames.at(0);
  EXPECT_TRUE(frame.loops);
  ASSERT_EQ(frame.keys.size(), 3u);
  EXPECT_EQ(frame.keys[1].time, kThird);
  EXPECT_EQ(frame.keys[1].pose.position, Eigen::Vector3d(1, kThird, 3));
  EXPECT_EQ(frame.keys[1].pose.orientation.coeffs(), turned.coeffs());
  EXPECT_EQ(frame.keys[1].spin, Eigen::Vector3d(0, kThird, 0));
  EXPECT_EQ(frame.keys[2].velocity, Eigen::Vector3d(kThird, 0, 0)) << "that of the first";
  EXPECT_TRUE(frame.keys[1].velocity.has_value());
  // What has all velocities stays as it is.
  EXPECT_EQ(to_proto(*from_proto(to_proto(*back))).SerializeAsString(), to_proto(*back).SerializeAsString());
}

TEST(Convert, EverySettingIsAFieldAndSurvives) {
  const v1::WorldSettings message = to_proto(some_world().settings);
  for (const WorldSetting& setting : kSettings) {
    EXPECT_NE(v1::WorldSettings::descriptor()->FindFieldByName(setting.name), nullptr) << setting.name;
    const absl::StatusOr<WorldSettings> back = from_proto(message);
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(text_of(setting, *back), text_of(setting, some_world().settings));
  }
  const auto others = 4;  // uniform and central gravity, frames, modules
  EXPECT_EQ(v1::WorldSettings::descriptor()->field_count(), static_cast<int>(kSettings.size()) + others);
}

TEST(Convert, SettingsThatAreAbsentHaveTheirDefaults) {
  v1::WorldSettings message;
  message.mutable_uniform_gravity();
  message.set_sleep_after(0);
  const absl::StatusOr<WorldSettings> settings = from_proto(message);
  ASSERT_TRUE(settings.ok()) << settings.status();
  for (const WorldSetting& setting : kSettings) {
    const bool is_set = setting.member == WorldSetting::Member(&WorldSettings::sleep_after);
    EXPECT_EQ(text_of(setting, *settings), is_set ? "0" : text_of(setting, WorldSettings()));
  }
}

TEST(Convert, CountersSurviveByPlaceAndByName) {
  TickCounts counts;
  std::uint64_t next = std::uint64_t{1} << 40;
  for (const TickCounter& counter : kTickCounters) counts.*counter.value = ++next;
  CountsByPlace by_place;
  write(counts, by_place);
  EXPECT_EQ(counts_from(by_place), counts);
  CountsByName by_name;
  write(counts, by_name);
  EXPECT_EQ(counts_from(by_name), counts);
  by_place.Truncate(1);
  EXPECT_EQ(counts_from(by_place).*kTickCounters[0].value, counts.*kTickCounters[0].value);
  EXPECT_EQ(counts_from(by_place).*kTickCounters[1].value, 0u);
}

TEST(Convert, EveryGeometrySurvives) {
  const absl::StatusOr<Shape> back = from_proto(to_proto(every_geometry()));
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->parts.size(), std::variant_size_v<Geometry>);
  for (std::size_t n = 0; n < back->parts.size(); ++n) EXPECT_EQ(back->parts[n].geometry.index(), n);
  EXPECT_EQ(std::get<TriangleMesh>(back->parts[7].geometry).indices, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(std::get<HeightField>(back->parts[8].geometry).spacing, Eigen::Vector2d(0.5, 0.25));
  EXPECT_EQ(std::get<Ground>(back->parts[9].geometry), some_ground());
}

TEST(Convert, MaterialsOfPartsSurvive) {
  Shape shape{{ShapePart{Box{}, {}}, ShapePart{Sphere{}, {}}}};
  shape.parts[1].material = PartMaterial{0.25, 0.5, 6, 3, Surface{{0, 1, 0}, 0.1, 0.5, 0.01, 0.02}, true};
  const absl::StatusOr<Shape> back = from_proto(to_proto(shape));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->parts[0].material, std::nullopt);
  EXPECT_EQ(back->parts[1].material, shape.parts[1].material);
}

TEST(Convert, AbsentQuaternionsAreIdentities) {
  EXPECT_TRUE(from_proto(v1::Pose()).is_identity());
  EXPECT_EQ(from_proto(v1::WorldPose()).orientation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(from_proto(v1::BodyProperties())->principal_axes, (std::array<double, 4>{0, 0, 0, 1}));
}

template <typename Message>
void expect_refused(const Message& message, const std::string& text) {
  const absl::Status status = from_proto(message).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr(text));
}

TEST(Convert, RefusesWhatATypeCannotHold) {
  v1::World world = to_proto(some_world());
  world.clear_settings();
  expect_refused(world, "settings must be set");

  world = to_proto(some_world());
  world.mutable_settings()->clear_gravity();
  expect_refused(world, "settings: gravity must be set");

  world = to_proto(some_world());
  world.mutable_settings()->set_precision(static_cast<v1::Precision>(9));
  expect_refused(world, "settings: precision = 9");

  world = to_proto(some_world());
  world.mutable_settings()->set_seams(static_cast<v1::SeamPolicy>(5));
  expect_refused(world, "settings: seams = 5");

  world = to_proto(some_world());
  world.mutable_settings()->set_clone_depth(0xffffffff);
  expect_refused(world, "settings: clone_depth = 4294967295");

  world = to_proto(some_world());
  world.mutable_settings()->set_solver_iterations(0x80000000);
  expect_refused(world, "settings: solver_iterations");

  world = to_proto(some_world());
  world.mutable_shapes(1)->mutable_parts(0)->clear_geometry();
  expect_refused(world, "shape 1: part 0: geometry must be set");

  world = to_proto(some_world());
  world.mutable_shapes(0)->mutable_parts(6)->mutable_geometry()->mutable_convex_hull()->add_points(1);
  expect_refused(world, "shape 0: part 6: convex_hull.points");

  world = to_proto(some_world());
  world.mutable_shapes(0)->mutable_parts(7)->mutable_geometry()->mutable_triangle_mesh()->add_vertices(1);
  expect_refused(world, "shape 0: part 7: triangle_mesh.vertices");

  world = to_proto(some_world());
  world.mutable_bodies(0)->clear_pose();
  expect_refused(world, "body 'model::link': pose must be set");

  world = to_proto(some_world());
  world.mutable_bodies(1)->clear_properties();
  expect_refused(world, "body 'plain': properties must be set");

  world = to_proto(some_world());
  world.mutable_bodies(1)->mutable_properties()->set_motion(static_cast<v1::Motion>(3));
  expect_refused(world, "body 'plain': motion = 3");

  world = to_proto(some_world());
  world.mutable_joints(1)->clear_properties();
  expect_refused(world, "joint 'screw': properties must be set");

  world = to_proto(some_world());
  world.mutable_joints(1)->mutable_properties()->set_type(static_cast<v1::JointType>(6));
  expect_refused(world, "joint 'screw': type = 6");

  world = to_proto(some_world());
  world.mutable_joints(1)->mutable_properties()->add_axes();
  expect_refused(world, "joint 'screw': the number of axes, 2, must be at most 1");

  world = to_proto(some_world());
  world.mutable_joints(0)->mutable_drives(1)->set_mode(static_cast<v1::JointDrive::Mode>(5));
  expect_refused(world, "joint 'model::joint': drive of axis 2: mode = 5");

  world = to_proto(some_world());
  world.mutable_joints(0)->add_drives();
  expect_refused(world, "joint 'model::joint': the number of drives, 3, must be at most 2");
}

}  // namespace
}  // namespace tessera
