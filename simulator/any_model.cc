// Models at random: bodies of every shape, joints of every type.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "lpss/joints/joint_form.h"
#include "lpss/model/limits.h"
#include "proto/convert.h"
#include "simulator/any_message.h"
#include "simulator/late_module.h"

namespace tessera {
namespace {

constexpr std::uint64_t kModelBodiesMax = 4;
constexpr std::uint64_t kProgramsMax = 3;  // of a body that has some
constexpr double kModelApart = 0.7;        // m, between bodies of a model
constexpr double kHugeNumber = 1e300;
constexpr double kGainUsual = 1e4;

bool is_known_static(v1::Motion motion) { return motion == v1::MOTION_STATIC; }

}  // namespace

// Where a model has several bodies, joints hold most of them.
void AnyMessage::fill_model(v1::Model& model) {
  const std::uint64_t bodies = dice_.one_in(2) ? 1 : 1 + dice_.below(kModelBodiesMax);
  for (std::uint64_t n = 0; n < bodies; ++n) {
    fill_body(*model.add_bodies(), model, kModelApart * static_cast<double>(n));
  }
  AnyProgram program = any_program();
  for (v1::Body& body : *model.mutable_bodies()) {
    const v1::Motion motion = body.properties().motion();
    if (is_known_static(motion) || !dice_.one_in(3)) continue;
    for (std::uint64_t left = 1 + dice_.below(kProgramsMax); left > 0; --left)
      *body.add_programs() = program.for_body(motion, bodies, bodies - 1);
  }
  if (is_valid_ || !dice_.one_in(3)) bring_late_module(model);
  for (std::uint64_t child = 2; child <= bodies; ++child) {
    v1::Joint& joint = *model.add_joints();
    fill_joint(joint);
    joint.mutable_properties()->set_parent(dice_.one_in(6) ? 0 : dice_.below(child));
    joint.mutable_properties()->set_child(child);
    if (child > 2 && dice_.one_in(4)) {  // some joints form circles
      v1::Joint& another = *model.add_joints();
      fill_joint(another);
      another.mutable_properties()->set_parent(1);
      another.mutable_properties()->set_child(child);
    }
  }
  if (!dice_.one_in(8)) return;
  v1::Frame& frame = *model.add_frames();
  frame.set_name("frame" + std::to_string(dice_.below(1'000'000)));
  frame.set_body(1 + dice_.below(bodies));
}

void AnyMessage::fill_body(v1::Body& body, v1::Model& model, double apart) {
  v1::BodyProperties& properties = *body.mutable_properties();
  const std::uint64_t draw = dice_.below(12);
  properties.set_motion(draw == 0   ? v1::MOTION_STATIC
                        : draw == 1 ? v1::MOTION_KINEMATIC
                                    : v1::MOTION_DYNAMIC);
  fill_properties(properties);
  fill_shape(*model.add_shapes(), is_known_static(properties.motion()));
  properties.set_shape(static_cast<std::uint64_t>(model.shapes_size()) - 1);
  if (dice_.one_in(3)) body.set_name("any" + std::to_string(dice_.below(100'000'000)));
  fill_position(*body.mutable_pose()->mutable_position());
  if (apart > 0) {  // near the first one
    *body.mutable_pose()->mutable_position() = model.bodies(0).pose().position();
    v1::Vector3& local = *body.mutable_pose()->mutable_position()->mutable_local();
    local.set_x(local.x() + apart);
  }
  fill_quaternion(*body.mutable_pose()->mutable_orientation());
  if (is_known_static(properties.motion())) return;
  if (dice_.one_in(3)) fill_vector(*body.mutable_linear_velocity(), {-kSpeedMax / 2, kSpeedMax / 2});
  if (dice_.one_in(3))
    fill_vector(*body.mutable_angular_velocity(), {-kAngularSpeedMax / 2, kAngularSpeedMax / 2});
}

AnyProgram AnyMessage::any_program() {
  return {dice_, world_, [this](const NumberSpec& spec) { return numbers_.within({spec.least, spec.most}); }};
}

// Most often, to a program that the world has.
void AnyMessage::fill_tell(v1::TellProgram& command) {
  AnyProgram program = any_program();
  if (!world_.programs.empty() && (is_valid_ || !dice_.one_in(3))) {
    command = program.told();
  } else {
    fill_body_ref(*command.mutable_body());
    program.tell_any(*command.mutable_numbers());
  }
  if (!is_valid_ && dice_.one_in(4)) command.set_program(static_cast<std::uint32_t>(numbers_.count()));
}

// The inertia is that of a ball of some size, or flatter.
void AnyMessage::fill_properties(v1::BodyProperties& properties) {
  properties.set_mass(numbers_.within({kMassMin, kMassMax}));
  const double radius = std::clamp(extent(), 1e-3, 1e3);
  const double moment =
      std::clamp(0.4 * properties.mass() * radius * radius, kInertiaMin / kMomentRatioMin, kInertiaMax);
  v1::Vector3& inertia = *properties.mutable_inertia();
  inertia.set_x(moment);
  inertia.set_y(moment);
  inertia.set_z(moment * (dice_.one_in(4) ? kMomentRatioMin * 1.01 : dice_.between(0.1, 1.0)));
  properties.set_friction(numbers_.within({0, kHugeNumber, 1}));
  properties.set_restitution(dice_.one_in(2) ? 0 : numbers_.within({0, 1}));
  properties.set_linear_damping(dice_.one_in(2) ? 0 : numbers_.within({0, 1}));
  properties.set_angular_damping(dice_.one_in(2) ? 0 : numbers_.within({0, 1}));
  properties.set_category(1);
  properties.set_mask(UINT32_MAX);
  properties.set_no_gravity(dice_.one_in(8));
  properties.set_assembly(dice_.one_in(4) ? 1 : 0);
  properties.set_trigger(dice_.one_in(15));
  if (dice_.one_in(6)) fill_quaternion(*properties.mutable_principal_axes());
  if (dice_.one_in(6)) fill_vector(*properties.mutable_centre(), {-extent(), extent(), 0.1});
  if (dice_.one_in(6)) fill(*properties.mutable_surface());
  if (properties.motion() == v1::MOTION_DYNAMIC && dice_.one_in(10))
    fill(*properties.mutable_lasting_force());
}

void AnyMessage::fill_shape(v1::Shape& shape, bool is_static) {
  const std::uint64_t parts = dice_.one_in(4) ? 1 + dice_.below(3) : 1;
  for (std::uint64_t n = 0; n < parts; ++n) {
    v1::Shape::Part& part = *shape.add_parts();
    fill_geometry(*part.mutable_geometry(), is_static);
    if (parts > 1) fill_vector(*part.mutable_pose()->mutable_position(), {-1, 1, 0.5});
    if (!dice_.one_in(8)) continue;
    v1::PartMaterial& material = *part.mutable_material();
    fill(material);
    material.clear_surface();
  }
}

// m: of what fits into a sector, most often.
double AnyMessage::extent() {
  const double largest = world_.settings.sector_size / 2;
  return numbers_.within({kExtentMin, dice_.one_in(8) ? largest : std::min(largest, 1.0), 0.6});
}

void AnyMessage::fill_geometry(v1::Geometry& geometry, bool is_static) {
  constexpr int kConvex = 6;
  const google::protobuf::OneofDescriptor& kinds = *v1::Geometry::descriptor()->oneof_decl(0);
  const auto count = static_cast<std::uint64_t>(kinds.field_count());
  const std::uint64_t kind =
      is_static || (!is_valid_ && dice_.one_in(10)) ? dice_.below(count) : dice_.below(kConvex + 2);
  switch (kinds.field(static_cast<int>(kind % count))->number()) {
    case v1::Geometry::kSphere:
      return geometry.mutable_sphere()->set_radius(extent());
    case v1::Geometry::kCapsule:
      geometry.mutable_capsule()->set_radius(extent());
      return geometry.mutable_capsule()->set_length(extent());
    case v1::Geometry::kCylinder:
      geometry.mutable_cylinder()->set_radius(extent());
      return geometry.mutable_cylinder()->set_length(extent());
    case v1::Geometry::kEllipsoid:
      *geometry.mutable_ellipsoid()->mutable_radii() =
          to_proto(Eigen::Vector3d(extent(), extent(), extent()));
      return;
    case v1::Geometry::kPlane:
      if (!is_static) break;
      *geometry.mutable_plane()->mutable_normal() =
          to_proto(Eigen::Vector3d(dice_.between(-1.0, 1.0), dice_.between(-1.0, 1.0), 1).normalized());
      return;
    case v1::Geometry::kConvexHull:
      return fill_hull(*geometry.mutable_convex_hull());
    case v1::Geometry::kTriangleMesh:
      if (!is_static) break;
      return fill_mesh(*geometry.mutable_triangle_mesh());
    case v1::Geometry::kHeightField:
      return fill_heights(*geometry.mutable_height_field());
    case v1::Geometry::kGround:
      return fill_ground(*geometry.mutable_ground());
    default:
      break;
  }
  *geometry.mutable_box()->mutable_size() = to_proto(Eigen::Vector3d(extent(), extent(), extent()));
}

void AnyMessage::fill_hull(v1::Geometry::ConvexHull& hull) {
  const double size = extent();
  for (std::uint64_t left = 4 + dice_.below(20); left > 0; --left) {
    for (int axis = 0; axis < 3; ++axis) hull.add_points(dice_.between(-size, size));
  }
}

void AnyMessage::fill_mesh(v1::Geometry::TriangleMesh& mesh) {
  const std::uint64_t vertices = 3 + dice_.below(10);
  const double size = numbers_.within({kExtentMin, kStaticExtentMax / 4, 10});
  for (std::uint64_t n = 0; n < vertices; ++n) {
    mesh.add_vertices(dice_.between(-size, size));
    mesh.add_vertices(dice_.between(-size, size));
    mesh.add_vertices(dice_.between(-0.1, 0.1) * size);
  }
  for (std::uint64_t left = 1 + dice_.below(6); left > 0; --left) {
    const std::uint64_t first = dice_.below(vertices);
    for (std::uint64_t corner = 0; corner < 3; ++corner)
      mesh.add_indices(static_cast<std::uint32_t>((first + corner) % vertices));
  }
}

void AnyMessage::fill_heights(v1::Geometry::HeightField& heights) {
  heights.set_columns(static_cast<std::uint32_t>(2 + dice_.below(6)));
  heights.set_rows(static_cast<std::uint32_t>(2 + dice_.below(6)));
  heights.set_spacing_x(numbers_.within({1e-3, 1e6, 4}));
  heights.set_spacing_y(numbers_.within({1e-3, 1e6, 4}));
  const std::uint64_t missing = !is_valid_ && dice_.one_in(4) ? 1 : 0;
  for (std::uint64_t n = missing; n < std::uint64_t{heights.columns()} * heights.rows(); ++n)
    heights.add_heights(numbers_.within({-1e4, 1e4, 1}));
}

void AnyMessage::fill_ground(v1::Geometry::Ground& ground) {
  ground.set_source(dice_.one_in(2) ? v1::Geometry::Ground::SOURCE_PLAIN
                                    : v1::Geometry::Ground::SOURCE_PLANET);
  if (!is_valid_ && dice_.one_in(10)) ground.set_source(v1::Geometry::Ground::SOURCE_FOLDER);
  const double size = world_.settings.sector_size;
  ground.set_spacing(numbers_.within({size / kGroundCellsMax, size, size / 4}));
  ground.set_radius(ground.spacing() * dice_.between(kGroundSpacingsMin, 1e4));
  ground.set_height(numbers_.within({0, 100, 1}));
  ground.set_octaves(static_cast<std::uint32_t>(1 + dice_.below(3)));
  ground.set_wavelength(ground.spacing() * dice_.between(8.0, 100.0));
  ground.set_seed(dice_.below(1000));
}

void AnyMessage::fill_joint(v1::Joint& joint) {
  v1::JointProperties& properties = *joint.mutable_properties();
  const auto type = static_cast<v1::JointType>(dice_.below(v1::JointType_ARRAYSIZE));
  properties.set_type(type);
  const double far = dice_.one_in(10) ? world_.settings.sector_size / 2 : 0.5;
  fill_vector(*properties.mutable_in_parent()->mutable_position(), {-far, far, 0.5});
  fill_vector(*properties.mutable_in_child()->mutable_position(), {-far, far, 0.5});
  if (dice_.one_in(2)) fill_quaternion(*properties.mutable_in_parent()->mutable_orientation());
  if (dice_.one_in(4)) fill_quaternion(*properties.mutable_in_child()->mutable_orientation());
  const WorldPosition& near = world_.places[dice_.below(world_.places.size())];
  *properties.mutable_anchor() = to_proto(near).sector();
  properties.set_pitch(dice_.between(0.01, 1.0) * (dice_.one_in(8) ? 1e6 : 1));
  properties.set_bodies_collide(dice_.one_in(4));
  const int axes = axis_count(static_cast<JointType>(type));
  for (int n = 0; n < axes; ++n) {
    v1::JointAxis& axis = *properties.add_axes();
    if (dice_.one_in(2)) {
      const double turn = std::numbers::pi;
      axis.set_lower(numbers_.within({-turn, 0, 1}));
      axis.set_upper(numbers_.within({0, turn, 1}));
    }
    if (dice_.one_in(4)) axis.set_velocity_max(numbers_.within({1e-300, kHugeNumber}));
    if (dice_.one_in(4)) axis.set_effort_max(numbers_.within({0, kHugeNumber, 100}));
    if (dice_.one_in(4)) axis.set_damping(numbers_.within({0, kHugeNumber}));
    if (dice_.one_in(4)) axis.set_friction(numbers_.within({0, kHugeNumber}));
    if (dice_.one_in(4)) axis.set_spring_stiffness(numbers_.within({0, kGainMax, kGainUsual}));
    if (dice_.one_in(4)) axis.set_spring_reference(numbers_.within({-kDriveWayMax, kDriveWayMax, 1}));
    if (dice_.one_in(4)) axis.set_armature(numbers_.within({0, kArmatureMax, 1}));
    if (!world_.joints.empty() && dice_.one_in(10)) {
      axis.mutable_mimic()->set_leader(world_.joints[dice_.below(world_.joints.size())].id);
      axis.mutable_mimic()->set_axis(1);
      axis.mutable_mimic()->set_multiplier(numbers_.within({-kMimicMultiplierMax, kMimicMultiplierMax, 2}));
    }
    fill_drive(*joint.add_drives());
  }
}

void AnyMessage::fill_drives(v1::SetJointDrives& command) {
  fill_joint_ref(*command.mutable_joint());
  v1::AxisDrive& drive = *command.add_drives();
  drive.set_axis(!is_valid_ && dice_.one_in(8) ? static_cast<std::uint32_t>(numbers_.count()) : 1);
  fill_drive(*drive.mutable_drive());
}

// Of some joints, or of one that there is not, with columns of one length or another.
void AnyMessage::fill_drives(v1::DriveJoints& command) {
  const std::size_t count = 1 + dice_.below(4);
  for (std::size_t n = 0; n < count; ++n) {
    const bool is_there = !world_.joints.empty() && (is_valid_ || !dice_.one_in(8));
    command.add_joints(is_there ? world_.joints[dice_.below(world_.joints.size())].id : numbers_.count());
  }
  command.set_axis(!is_valid_ && dice_.one_in(8) ? static_cast<std::uint32_t>(numbers_.count()) : 1);
  v1::JointDrive drive;
  fill_drive(drive);
  command.set_mode(drive.mode());
  const std::size_t targets = !is_valid_ && dice_.one_in(8) ? dice_.below(4) : dice_.one_in(2) ? 1 : count;
  for (std::size_t n = 0; n < targets; ++n) command.add_targets(drive.target());
  command.add_stiffness(drive.stiffness());
  command.add_damping(drive.damping());
  command.add_velocities(drive.velocity());
  command.add_efforts(drive.effort());
}

// Within the bounds of an angle, which are the narrower ones, most often.
void AnyMessage::fill_drive(v1::JointDrive& drive) {
  drive.set_mode(static_cast<v1::JointDrive::Mode>(dice_.below(v1::JointDrive::Mode_ARRAYSIZE)));
  const double way = is_valid_ ? std::numbers::pi : kDriveWayMax;
  switch (drive.mode()) {
    case v1::JointDrive::VELOCITY:
      return drive.set_target(numbers_.within({-kAngularSpeedMax, kAngularSpeedMax}));
    case v1::JointDrive::POSITION:
      return drive.set_target(numbers_.within({-way, way, 3}));
    case v1::JointDrive::EFFORT:
      return drive.set_target(numbers_.within({-kTorqueMax, kTorqueMax, 100}));
    case v1::JointDrive::SERVO:
      drive.set_target(numbers_.within({-way, way, 3}));
      drive.set_stiffness(numbers_.within({0, kGainMax, kGainUsual}));
      drive.set_damping(numbers_.within({0, kGainMax, kGainUsual}));
      drive.set_velocity(numbers_.within({-kAngularSpeedMax, kAngularSpeedMax}));
      return drive.set_effort(numbers_.within({-kTorqueMax, kTorqueMax, 100}));
    default:
      return;
  }
}

}  // namespace tessera
