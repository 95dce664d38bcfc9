#include "proto/convert.h"

#include <absl/strings/str_cat.h>

#include <bit>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "lpss/model/checks.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

Eigen::Quaterniond quaternion(const v1::Quaternion& q) {
  return Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z());
}

void append(google::protobuf::RepeatedField<double>& numbers, const std::vector<Eigen::Vector3d>& points) {
  numbers.Reserve(static_cast<int>(3 * points.size()));
  for (const Eigen::Vector3d& point : points) {
    for (const double coordinate : point) numbers.Add(coordinate);
  }
}

absl::StatusOr<std::vector<Eigen::Vector3d>> points(const google::protobuf::RepeatedField<double>& numbers,
                                                    const char* what) {
  if (numbers.size() % 3 != 0) {
    return refused(what, ": the number of coordinates, ", numbers.size(), ", must be a multiple of 3");
  }
  std::vector<Eigen::Vector3d> result;
  result.reserve(numbers.size() / 3);
  for (int n = 0; n < numbers.size(); n += 3) result.emplace_back(numbers[n], numbers[n + 1], numbers[n + 2]);
  return result;
}

struct GeometryWriter {
  v1::Geometry& to;

  void operator()(const Box& box) const { *to.mutable_box()->mutable_size() = to_proto(box.size); }
  void operator()(const Sphere& sphere) const { to.mutable_sphere()->set_radius(sphere.radius); }
  void operator()(const Capsule& capsule) const {
    to.mutable_capsule()->set_radius(capsule.radius);
    to.mutable_capsule()->set_length(capsule.length);
  }
  void operator()(const Cylinder& cylinder) const {
    to.mutable_cylinder()->set_radius(cylinder.radius);
    to.mutable_cylinder()->set_length(cylinder.length);
  }
  void operator()(const Ellipsoid& ellipsoid) const {
    *to.mutable_ellipsoid()->mutable_radii() = to_proto(ellipsoid.radii);
  }
  void operator()(const Plane& plane) const {
    *to.mutable_plane()->mutable_normal() = to_proto(plane.normal);
  }
  void operator()(const ConvexHull& hull) const {
    append(*to.mutable_convex_hull()->mutable_points(), hull.points);
  }
  void operator()(const TriangleMesh& mesh) const {
    append(*to.mutable_triangle_mesh()->mutable_vertices(), mesh.vertices);
    to.mutable_triangle_mesh()->mutable_indices()->Add(mesh.indices.begin(), mesh.indices.end());
  }
  void operator()(const HeightField& field) const {
    v1::Geometry::HeightField& result = *to.mutable_height_field();
    result.set_columns(field.columns);
    result.set_rows(field.rows);
    result.set_spacing_x(field.spacing.x());
    result.set_spacing_y(field.spacing.y());
    result.mutable_heights()->Add(field.heights.begin(), field.heights.end());
  }
  void operator()(const Ground& ground) const {
    v1::Geometry::Ground& result = *to.mutable_ground();
    result.set_source(static_cast<v1::Geometry::Ground::Source>(ground.source));
    result.set_spacing(ground.spacing);
    result.set_radius(ground.radius);
    result.set_height(ground.height);
    result.set_wavelength(ground.wavelength);
    result.set_octaves(ground.octaves);
    result.set_seed(ground.seed);
    result.set_has_sea(ground.has_sea);
    result.set_folder(ground.folder);
    result.set_checksum(ground.checksum);
    result.set_edge(ground.edge);
    result.set_low(ground.low);
  }
};

absl::StatusOr<Geometry> mesh_of(const v1::Geometry::TriangleMesh& mesh) {
  absl::StatusOr<std::vector<Eigen::Vector3d>> vertices = points(mesh.vertices(), "triangle_mesh.vertices");
  if (!vertices.ok()) return vertices.status();
  return TriangleMesh{*std::move(vertices), {mesh.indices().begin(), mesh.indices().end()}};
}

absl::StatusOr<Geometry> ground_of(const v1::Geometry::Ground& from) {
  if (!v1::Geometry::Ground::Source_IsValid(from.source()))
    return refused("ground.source ", static_cast<int>(from.source()), " must be plain, planet or folder");
  return Ground{.source = static_cast<Ground::Source>(from.source()),
                .spacing = from.spacing(),
                .radius = from.radius(),
                .height = from.height(),
                .wavelength = from.wavelength(),
                .octaves = from.octaves(),
                .seed = from.seed(),
                .has_sea = from.has_sea(),
                .folder = from.folder(),
                .edge = from.edge(),
                .low = from.low(),
                .checksum = from.checksum()};
}

absl::StatusOr<Geometry> geometry(const v1::Geometry& from) {
  switch (from.kind_case()) {
    case v1::Geometry::kBox:
      return Box{from_proto(from.box().size())};
    case v1::Geometry::kSphere:
      return Sphere{from.sphere().radius()};
    case v1::Geometry::kCapsule:
      return Capsule{from.capsule().radius(), from.capsule().length()};
    case v1::Geometry::kCylinder:
      return Cylinder{from.cylinder().radius(), from.cylinder().length()};
    case v1::Geometry::kEllipsoid:
      return Ellipsoid{from_proto(from.ellipsoid().radii())};
    case v1::Geometry::kPlane:
      return Plane{from_proto(from.plane().normal())};
    case v1::Geometry::kConvexHull: {
      absl::StatusOr<std::vector<Eigen::Vector3d>> hull =
          points(from.convex_hull().points(), "convex_hull.points");
      if (!hull.ok()) return hull.status();
      return ConvexHull{*std::move(hull)};
    }
    case v1::Geometry::kTriangleMesh:
      return mesh_of(from.triangle_mesh());
    case v1::Geometry::kHeightField: {
      const v1::Geometry::HeightField& field = from.height_field();
      return HeightField{field.columns(),
                         field.rows(),
                         {field.spacing_x(), field.spacing_y()},
                         {field.heights().begin(), field.heights().end()}};
    }
    case v1::Geometry::kGround:
      return ground_of(from.ground());
    case v1::Geometry::KIND_NOT_SET:
      break;
  }
  return refused("geometry must be set to a known kind");
}

Eigen::Vector3d vector(const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); }
std::array<double, 3> array(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

v1::SectorIndex to_proto(const SectorIndex& sector) {
  v1::SectorIndex result;
  result.set_i(sector.i);
  result.set_j(sector.j);
  result.set_k(sector.k);
  result.set_frame(sector.frame);
  return result;
}

v1::Vector3 to_proto(const Eigen::Vector3d& vector) {
  v1::Vector3 result;
  result.set_x(vector.x());
  result.set_y(vector.y());
  result.set_z(vector.z());
  return result;
}

v1::Quaternion to_proto(const Eigen::Quaterniond& quaternion) {
  v1::Quaternion result;
  result.set_x(quaternion.x());
  result.set_y(quaternion.y());
  result.set_z(quaternion.z());
  result.set_w(quaternion.w());
  return result;
}

v1::WorldPosition to_proto(const WorldPosition& position) {
  v1::WorldPosition result;
  *result.mutable_sector() = to_proto(position.sector);
  *result.mutable_local() = to_proto(position.local);
  return result;
}

v1::WorldPose to_proto(const WorldPose& pose) {
  v1::WorldPose result;
  *result.mutable_position() = to_proto(pose.position);
  *result.mutable_orientation() = to_proto(pose.orientation);
  return result;
}

v1::Pose to_proto(const Pose& pose) {
  v1::Pose result;
  *result.mutable_position() = to_proto(pose.position);
  *result.mutable_orientation() = to_proto(pose.orientation);
  return result;
}

v1::NumberedShape to_proto(const ShapeEntry& entry) {
  v1::NumberedShape result;
  result.set_id(entry.id);
  *result.mutable_shape() = to_proto(*entry.shape);
  return result;
}

v1::Surface to_proto(const Surface& surface) {
  v1::Surface result;
  *result.mutable_direction() = to_proto(vector(surface.direction));
  result.set_second_friction(surface.second_friction);
  result.set_torsional_friction(surface.torsional_friction);
  result.set_patch_radius(surface.patch_radius);
  result.set_rolling_friction(surface.rolling_friction);
  *result.mutable_velocity() = to_proto(vector(surface.velocity));
  *result.mutable_running() = to_proto(vector(surface.running));
  return result;
}

v1::PartMaterial to_proto(const PartMaterial& material) {
  v1::PartMaterial result;
  result.set_friction(material.friction);
  result.set_restitution(material.restitution);
  result.set_category(material.category);
  result.set_mask(material.mask);
  if (material.surface != Surface{}) *result.mutable_surface() = to_proto(material.surface);
  result.set_trigger(material.trigger);
  return result;
}

v1::Shape to_proto(const Shape& shape) {
  v1::Shape result;
  for (const ShapePart& part : shape.parts) {
    v1::Shape::Part& to = *result.add_parts();
    std::visit(GeometryWriter{*to.mutable_geometry()}, part.geometry);
    *to.mutable_pose() = to_proto(part.pose);
    if (part.material) *to.mutable_material() = to_proto(*part.material);
  }
  return result;
}

v1::LastingForce to_proto(const LastingForce& lasting) {
  v1::LastingForce result;
  *result.mutable_force() = to_proto(vector(lasting.wrench.force));
  *result.mutable_torque() = to_proto(vector(lasting.wrench.torque));
  result.set_body_axes(lasting.turns_along);
  return result;
}

v1::BodyProperties to_proto(const BodyProperties& properties) {
  v1::BodyProperties result;
  result.set_motion(to_proto(properties.motion));
  result.set_shape(properties.shape);
  result.set_mass(properties.mass);
  *result.mutable_inertia() = to_proto(vector(properties.inertia));
  *result.mutable_centre() = to_proto(vector(properties.centre));
  *result.mutable_principal_axes() = to_proto(centre_frame(properties).orientation);
  result.set_friction(properties.friction);
  result.set_restitution(properties.restitution);
  result.set_linear_damping(properties.linear_damping);
  result.set_angular_damping(properties.angular_damping);
  result.set_category(properties.category);
  result.set_mask(properties.mask);
  result.set_no_gravity(!properties.gravity);
  result.set_assembly(properties.assembly);
  if (properties.surface) *result.mutable_surface() = to_proto(*properties.surface);
  result.set_trigger(properties.trigger);
  if (properties.lasting) *result.mutable_lasting_force() = to_proto(*properties.lasting);
  return result;
}

v1::Program to_proto(const ProgramRecord& record) {
  v1::Program result;
  result.set_kind(record.kind);
  result.set_name(record.name);
  const Program* const program = find_program(record.kind);
  if (program == nullptr) return result;
  const auto add = [&](std::span<const double> numbers, std::span<const NumberSpec> table) {
    for (std::size_t n = 0; n < numbers.size() && n < table.size(); ++n) {
      // By their bits: 0 and -0 are two numbers.
      if (std::bit_cast<std::uint64_t>(numbers[n]) == std::bit_cast<std::uint64_t>(table[n].first)) continue;
      v1::NamedNumber& number = *result.add_numbers();
      number.set_name(std::string(table[n].name));
      number.set_value(numbers[n]);
    }
  };
  add(record.parameters, program->parameters());
  add(record.inputs, program->inputs());
  return result;
}

v1::Body to_proto(const BodyDescription& body) {
  v1::Body result;
  result.set_name(body.name);
  *result.mutable_properties() = to_proto(body.properties);
  *result.mutable_pose() = to_proto(body.pose);
  *result.mutable_linear_velocity() = to_proto(body.linear_velocity);
  *result.mutable_angular_velocity() = to_proto(body.angular_velocity);
  result.set_user_data(body.user_data);
  for (const ProgramRecord& record : body.programs) *result.add_programs() = to_proto(record);
  return result;
}

v1::World to_proto(const WorldDescription& world) {
  v1::World result;
  result.set_name(world.name);
  *result.mutable_settings() = to_proto(world.settings);
  *result.mutable_anchor() = to_proto(world.anchor);
  result.mutable_shapes()->Reserve(static_cast<int>(world.shapes.size()));
  for (const Shape& shape : world.shapes) *result.add_shapes() = to_proto(shape);
  result.mutable_bodies()->Reserve(static_cast<int>(world.bodies.size()));
  for (const BodyDescription& body : world.bodies) *result.add_bodies() = to_proto(body);
  result.mutable_joints()->Reserve(static_cast<int>(world.joints.size()));
  for (const JointDescription& joint : world.joints) *result.add_joints() = to_proto(joint);
  for (const FrameDescription& frame : world.frames) {
    v1::Frame& added = *result.add_frames();
    added.set_name(frame.name);
    added.set_body(frame.body + 1);
    *added.mutable_pose() = to_proto(frame.pose);
  }
  return result;
}

v1::Divergence to_proto(const Divergence& divergence) {
  v1::Divergence result;
  result.set_tick(divergence.tick);
  result.set_body(divergence.body.value);
  result.set_joint(divergence.joint.value);
  result.set_kind(static_cast<v1::Divergence::Kind>(divergence.kind));
  return result;
}

Divergence from_proto(const v1::Divergence& divergence) {
  Divergence result{divergence.tick(), BodyId{divergence.body()}, JointId{divergence.joint()}};
  if (divergence.kind() >= 0 && divergence.kind() <= static_cast<int>(kDivergenceKindLast))
    result.kind = static_cast<DivergenceKind>(divergence.kind());
  return result;
}

v1::Precision to_proto(Precision precision) {
  return precision == Precision::kFloat32 ? v1::PRECISION_FLOAT32 : v1::PRECISION_FLOAT64;
}

SectorIndex from_proto(const v1::SectorIndex& sector) {
  return {sector.i(), sector.j(), sector.k(), sector.frame()};
}

Eigen::Vector3d from_proto(const v1::Vector3& vector) { return {vector.x(), vector.y(), vector.z()}; }

WorldPosition from_proto(const v1::WorldPosition& position) {
  return {from_proto(position.sector()), from_proto(position.local())};
}

WorldPose from_proto(const v1::WorldPose& pose) {
  WorldPose result;
  result.position = from_proto(pose.position());
  if (pose.has_orientation()) result.orientation = quaternion(pose.orientation());
  return result;
}

Pose from_proto(const v1::Pose& pose) {
  Pose result;
  result.position = from_proto(pose.position());
  if (pose.has_orientation()) result.orientation = quaternion(pose.orientation());
  return result;
}

Surface from_proto(const v1::Surface& surface) {
  Surface result;
  result.direction = array(surface.direction());
  result.second_friction = surface.second_friction();
  if (surface.has_torsional_friction()) result.torsional_friction = surface.torsional_friction();
  result.patch_radius = surface.patch_radius();
  result.rolling_friction = surface.rolling_friction();
  result.velocity = array(surface.velocity());
  result.running = array(surface.running());
  return result;
}

PartMaterial from_proto(const v1::PartMaterial& material) {
  PartMaterial result;
  result.friction = material.friction();
  result.restitution = material.restitution();
  result.category = material.category();
  result.mask = material.mask();
  if (material.has_surface()) result.surface = from_proto(material.surface());
  result.trigger = material.trigger();
  return result;
}

absl::StatusOr<Shape> from_proto(const v1::Shape& shape) {
  Shape result;
  result.parts.reserve(shape.parts_size());
  for (int n = 0; n < shape.parts_size(); ++n) {
    absl::StatusOr<Geometry> part = geometry(shape.parts(n).geometry());
    if (!part.ok()) return in(absl::StrCat("part ", n), part.status());
    ShapePart& added = result.parts.emplace_back(*std::move(part), from_proto(shape.parts(n).pose()));
    if (shape.parts(n).has_material()) added.material = from_proto(shape.parts(n).material());
  }
  return result;
}

LastingForce from_proto(const v1::LastingForce& lasting) {
  return {{array(lasting.force()), array(lasting.torque())}, lasting.body_axes()};
}

absl::StatusOr<BodyProperties> from_proto(const v1::BodyProperties& properties) {
  const absl::StatusOr<Motion> kind = from_proto(properties.motion());
  if (!kind.ok()) return kind.status();
  BodyProperties result;
  result.motion = *kind;
  result.shape = properties.shape();
  result.mass = properties.mass();
  result.inertia = array(properties.inertia());
  result.centre = array(properties.centre());
  if (properties.has_principal_axes()) {
    const v1::Quaternion& q = properties.principal_axes();
    result.principal_axes = {q.x(), q.y(), q.z(), q.w()};
  }
  result.friction = properties.friction();
  result.restitution = properties.restitution();
  result.linear_damping = properties.linear_damping();
  result.angular_damping = properties.angular_damping();
  result.category = properties.category();
  result.mask = properties.mask();
  result.gravity = !properties.no_gravity();
  result.assembly = properties.assembly();
  if (properties.has_surface()) result.surface = from_proto(properties.surface());
  result.trigger = properties.trigger();
  if (properties.has_lasting_force()) result.lasting = from_proto(properties.lasting_force());
  return result;
}

absl::StatusOr<ProgramRecord> from_proto(const v1::Program& program) {
  absl::StatusOr<ProgramRecord> record = new_program(program.kind());
  if (!record.ok()) return record;
  record->name = program.name();
  for (const v1::NamedNumber& number : program.numbers()) {
    if (absl::Status status = set_number(*record, number.name(), number.value()); !status.ok()) return status;
  }
  return record;
}

absl::StatusOr<BodyDescription> from_proto(const v1::Body& body) {
  const std::string title = absl::StrCat("body '", body.name(), "'");
  if (!body.has_properties()) return refused(title, ": properties must be set");
  if (!body.has_pose()) return refused(title, ": pose must be set");
  absl::StatusOr<BodyProperties> properties = from_proto(body.properties());
  if (!properties.ok()) return in(title, properties.status());
  BodyDescription result;
  result.name = body.name();
  result.properties = *properties;
  result.pose = from_proto(body.pose());
  result.linear_velocity = from_proto(body.linear_velocity());
  result.angular_velocity = from_proto(body.angular_velocity());
  result.user_data = body.user_data();
  if (body.programs_size() > static_cast<int>(kProgramsPerBodyMax))
    return refused(title, ": ", body.programs_size(), " programs must be at most ", kProgramsPerBodyMax);
  for (const v1::Program& program : body.programs()) {
    absl::StatusOr<ProgramRecord> record = from_proto(program);
    if (!record.ok()) return in(title, record.status());
    result.programs.push_back(*std::move(record));
  }
  return result;
}

absl::StatusOr<WorldDescription> from_proto(const v1::World& world) {
  if (!world.has_settings()) return refused("settings must be set");
  absl::StatusOr<WorldSettings> settings = from_proto(world.settings());
  if (!settings.ok()) return in("settings", settings.status());
  WorldDescription result;
  result.name = world.name();
  result.settings = *settings;
  result.anchor = from_proto(world.anchor());
  result.shapes.reserve(world.shapes_size());
  for (int n = 0; n < world.shapes_size(); ++n) {
    absl::StatusOr<Shape> shape = from_proto(world.shapes(n));
    if (!shape.ok()) return in(absl::StrCat("shape ", n), shape.status());
    result.shapes.push_back(*std::move(shape));
  }
  result.bodies.reserve(world.bodies_size());
  for (const v1::Body& from : world.bodies()) {
    absl::StatusOr<BodyDescription> body = from_proto(from);
    if (!body.ok()) return body.status();
    result.bodies.push_back(*std::move(body));
  }
  result.joints.reserve(world.joints_size());
  for (const v1::Joint& from : world.joints()) {
    absl::StatusOr<JointDescription> joint = from_proto(from);
    if (!joint.ok()) return joint.status();
    result.joints.push_back(*std::move(joint));
  }
  result.frames.reserve(world.frames_size());
  for (const v1::Frame& from : world.frames()) {
    if (from.body() == 0) return refused("frame '", from.name(), "': body must be at least 1");
    result.frames.push_back({from.name(), from.body() - 1, from_proto(from.pose())});
  }
  place_carried(result);
  return result;
}

v1::Motion to_proto(Motion motion) {
  switch (motion) {
    case Motion::kStatic:
      return v1::MOTION_STATIC;
    case Motion::kKinematic:
      return v1::MOTION_KINEMATIC;
    case Motion::kDynamic:
      break;
  }
  return v1::MOTION_DYNAMIC;
}

absl::StatusOr<Motion> from_proto(v1::Motion motion) {
  switch (motion) {
    case v1::MOTION_DYNAMIC:
      return Motion::kDynamic;
    case v1::MOTION_STATIC:
      return Motion::kStatic;
    case v1::MOTION_KINEMATIC:
      return Motion::kKinematic;
    default:
      return refused("motion = ", static_cast<int>(motion),
                     " must be 0 (dynamic), 1 (static) or 2 (kinematic)");
  }
}

absl::StatusOr<Precision> from_proto(v1::Precision precision) {
  if (precision == v1::PRECISION_FLOAT32) return Precision::kFloat32;
  if (precision == v1::PRECISION_FLOAT64) return Precision::kFloat64;
  return refused("precision = ", static_cast<int>(precision), " must be 0 (f32) or 1 (f64)");
}

}  // namespace tessera
