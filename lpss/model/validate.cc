#include "lpss/model/validate.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "lpss/model/checks.h"

namespace tessera {
namespace {

// Rounded inertia tensors of real files miss the triangle inequality by a little.
constexpr double kTriangleTolerance = 1e-3;

absl::Status length(absl::string_view what, double value) {
  return bounded(what, value, kExtentMin, kStaticExtentMax, "m");
}

absl::Status lengths(const std::string& what, const Eigen::Vector3d& value) {
  for (int axis = 0; axis < 3; ++axis) {
    if (absl::Status status = length(absl::StrCat(what, " ", std::string(1, "xyz"[axis])), value[axis]);
        !status.ok()) {
      return status;
    }
  }
  return absl::OkStatus();
}

absl::Status unit_normal(const Eigen::Vector3d& normal) {
  const double norm = normal.norm();
  if (std::isfinite(norm) && std::abs(norm - 1) <= kQuaternionNormTolerance) return absl::OkStatus();
  return refused("plane normal: the norm ", norm, " must be 1 within ", kQuaternionNormTolerance);
}

struct GeometryCheck {
  absl::Status operator()(const Box& box) const { return lengths("box size", box.size); }
  absl::Status operator()(const Sphere& sphere) const { return length("sphere radius", sphere.radius); }
  absl::Status operator()(const Capsule& capsule) const {
    if (absl::Status status = length("capsule radius", capsule.radius); !status.ok()) return status;
    return length("capsule length", capsule.length);
  }
  absl::Status operator()(const Cylinder& cylinder) const {
    if (absl::Status status = length("cylinder radius", cylinder.radius); !status.ok()) return status;
    return length("cylinder length", cylinder.length);
  }
  absl::Status operator()(const Ellipsoid& ellipsoid) const {
    return lengths("ellipsoid radius", ellipsoid.radii);
  }
  absl::Status operator()(const Plane& plane) const { return unit_normal(plane.normal); }
  absl::Status operator()(const ConvexHull& hull) const;
  absl::Status operator()(const TriangleMesh& mesh) const;
  absl::Status operator()(const HeightField& field) const;
  absl::Status operator()(const Ground& ground) const;
};

absl::Status GeometryCheck::operator()(const ConvexHull& hull) const {
  if (hull.points.size() < 4)
    return refused("convex hull: ", hull.points.size(), " points must be at least 4");
  if (hull.points.size() > kHullPointsMax) {
    return refused("convex hull: ", hull.points.size(), " points must be at most ", kHullPointsMax);
  }
  for (std::size_t n = 0; n < hull.points.size(); ++n) {
    absl::Status status =
        finite(absl::StrCat("convex hull: point ", n), hull.points[n], kStaticExtentMax, "m");
    if (!status.ok()) return status;
  }
  const double thick = slab_around(hull.points).thickness;
  if (thick < kExtentMin) {
    return refused("convex hull: all points lie in a plane: its thickness ", thick, " m must be at least ",
                   kExtentMin, " m");
  }
  return absl::OkStatus();
}

absl::Status GeometryCheck::operator()(const TriangleMesh& mesh) const {
  if (mesh.vertices.size() > kMeshVerticesMax) {
    return refused("mesh: ", mesh.vertices.size(), " vertices must be at most ", kMeshVerticesMax);
  }
  if (mesh.indices.size() > kMeshIndicesMax) {
    return refused("mesh: ", mesh.indices.size(), " indices must be at most ", kMeshIndicesMax);
  }
  if (mesh.indices.empty() || mesh.indices.size() % 3 != 0) {
    return refused("mesh: ", mesh.indices.size(), " indices must be a positive multiple of 3");
  }
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
    absl::Status status = finite(absl::StrCat("mesh: vertex ", n), mesh.vertices[n], kStaticExtentMax, "m");
    if (!status.ok()) return status;
  }
  for (std::size_t n = 0; n < mesh.indices.size(); ++n) {
    if (mesh.indices[n] >= mesh.vertices.size()) {
      return refused("mesh: index ", n, " = ", mesh.indices[n], " must be below the number of vertices, ",
                     mesh.vertices.size());
    }
  }
  return absl::OkStatus();
}

absl::Status GeometryCheck::operator()(const HeightField& field) const {
  if (field.columns < 2 || field.rows < 2) {
    return refused("height field: ", field.columns, " x ", field.rows, " samples must be at least 2 x 2");
  }
  const std::uint64_t samples = std::uint64_t{field.columns} * field.rows;
  if (samples > kHeightFieldSamplesMax) {
    return refused("height field: ", samples, " samples must be at most ", kHeightFieldSamplesMax);
  }
  if (samples != field.heights.size()) {
    return refused("height field: ", field.heights.size(), " heights must be ", field.columns, " x ",
                   field.rows, " = ", samples);
  }
  if (absl::Status status = length("height field spacing x", field.spacing.x()); !status.ok()) return status;
  if (absl::Status status = length("height field spacing y", field.spacing.y()); !status.ok()) return status;
  for (std::size_t n = 0; n < field.heights.size(); ++n) {
    absl::Status status = bounded(absl::StrCat("height field: height ", n), field.heights[n],
                                  -kStaticExtentMax, kStaticExtentMax, "m");
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status GeometryCheck::operator()(const Ground& ground) const {
  if (ground.source > Ground::Source::kFolder)
    return refused("ground: source ", static_cast<int>(ground.source), " must be plain, planet or folder");
  if (ground.folder.size() > kPathBytesMax) {
    return refused("ground: the folder's path of ", ground.folder.size(), " bytes must be at most ",
                   kPathBytesMax);
  }
  absl::Status status = bounded("ground: spacing", ground.spacing, kGroundSpacingMin, kStaticExtentMax, "m");
  if (!status.ok()) return status;
  if (ground.source == Ground::Source::kFolder) {
    if (ground.folder.empty()) return refused("ground: the folder's path must not be empty");
    if (status = bounded("ground: edge", ground.edge, 0, kStaticExtentMax, "m"); !status.ok()) return status;
    if (status = bounded("ground: low", ground.low, -kPlainHeightMax, kPlainHeightMax, "m"); !status.ok())
      return status;
    return bounded("ground: height", ground.height, ground.low, kPlainHeightMax, "m");
  }
  double height_max = kPlainHeightMax;
  if (ground.source == Ground::Source::kPlanet) {
    status =
        bounded("ground: radius", ground.radius, kGroundSpacingsMin * ground.spacing, kStaticExtentMax, "m");
    if (!status.ok()) return status;
    height_max = kPlanetHeightMax * ground.radius;
  }
  if (status = bounded("ground: height", ground.height, 0, height_max, "m"); !status.ok()) return status;
  if (status = bounded("ground: octaves", ground.octaves, 1, kGroundOctavesMax); !status.ok()) return status;
  // Narrower hills would fall between the vertices.
  const double finest = ground.spacing * std::ldexp(1, static_cast<int>(ground.octaves) - 1);
  return bounded("ground: wavelength", ground.wavelength, 2 * finest, kStaticExtentMax, "m");
}

absl::Status surface_check(const Surface& s) {
  if (absl::Status status = finite("friction direction", Eigen::Vector3d(s.direction.data())); !status.ok())
    return status;
  absl::Status status = bounded("second friction", s.second_friction, 0, kNoBound);
  if (!status.ok()) return status;
  status = bounded("torsional friction", s.torsional_friction, 0, kNoBound);
  if (!status.ok()) return status;
  status = bounded("patch radius", s.patch_radius, 0, kPatchRadiusMax, "m");
  if (!status.ok()) return status;
  status = bounded("rolling friction", s.rolling_friction, 0, kRollingFrictionMax, "m");
  if (!status.ok()) return status;
  status = finite("surface velocity", Eigen::Vector3d(s.velocity.data()), kSurfaceSpeedMax, "m/s");
  if (!status.ok()) return status;
  return finite("running surface", Eigen::Vector3d(s.running.data()), kSurfaceSpeedMax, "m/s");
}

absl::Status material_check(const PartMaterial& m) {
  if (absl::Status status = bounded("friction", m.friction, 0, kNoBound); !status.ok()) return status;
  if (absl::Status status = bounded("restitution", m.restitution, 0, 1); !status.ok()) return status;
  if (m.surface.velocity != std::array<double, 3>{} || m.surface.running != std::array<double, 3>{})
    return refused("the surface of a part does not move by itself");
  return surface_check(m.surface);
}

absl::Status part_check(const ShapePart& part) {
  if (absl::Status status = std::visit(GeometryCheck{}, part.geometry); !status.ok()) return status;
  if (absl::Status status = finite("pose", part.pose.position, kStaticExtentMax, "m"); !status.ok())
    return status;
  if (absl::Status status = unit_quaternion("pose", part.pose.orientation); !status.ok()) return status;
  return part.material ? in("material", material_check(*part.material)) : absl::OkStatus();
}

// The name of a geometry that only a static body may have, or nullptr.
const char* static_only(const Geometry& geometry) {
  if (std::holds_alternative<Plane>(geometry)) return "plane";
  if (std::holds_alternative<TriangleMesh>(geometry)) return "triangle mesh";
  if (std::holds_alternative<HeightField>(geometry)) return "height field";
  if (std::holds_alternative<Ground>(geometry)) return "ground";
  return nullptr;
}

// What a sector has of a ground must not be too many triangles.
absl::Status static_shape_check(const Shape& shape, double sector_size) {
  for (const ShapePart& part : shape.parts) {
    const auto* ground = std::get_if<Ground>(&part.geometry);
    if (ground == nullptr) continue;
    absl::Status status =
        bounded("ground: spacing", ground->spacing, sector_size / kGroundCellsMax, kNoBound, "m");
    if (!status.ok())
      return absl::InvalidArgumentError(
          absl::StrCat(status.message(), ", the sector size / ", kGroundCellsMax));
  }
  return absl::OkStatus();
}

absl::Status moving_shape_check(const BodyProperties& properties, const Shape& shape, double sector_size) {
  for (const ShapePart& part : shape.parts) {
    if (const char* kind = static_only(part.geometry); kind != nullptr) {
      return refused("a ", kind, " must belong to a static body; use convex hulls for one that moves");
    }
  }
  const Eigen::Vector3d centre = Eigen::Map<const Eigen::Vector3d>(properties.centre.data());
  const double diameter = 2 * bounding_radius(shape, centre);
  if (diameter > sector_size) {
    return refused("its bounding sphere's diameter ", diameter,
                   " m must be at most the sector size L = ", sector_size, " m, since it moves");
  }
  return absl::OkStatus();
}

absl::Status inertia_check(const std::array<double, 3>& inertia) {
  const double largest = *std::ranges::max_element(inertia);
  for (int axis = 0; axis < 3; ++axis) {
    const double moment = inertia[axis];
    if (!std::isfinite(moment) || moment <= 0) {
      return refused("principal moment of inertia ", axis, " = ", moment,
                     " kg m^2 must be finite and above 0");
    }
    absl::Status status = bounded(absl::StrCat("principal moment of inertia ", axis), moment, kInertiaMin,
                                  kInertiaMax, "kg m^2");
    if (!status.ok()) return status;
    if (moment < kMomentRatioMin * largest) {
      return refused("principal moment of inertia ", axis, " = ", moment, " kg m^2 must be at least ",
                     kMomentRatioMin, " of the largest, ", largest, " kg m^2");
    }
    const double others = inertia[(axis + 1) % 3] + inertia[(axis + 2) % 3];
    if (moment > others * (1 + kTriangleTolerance)) {
      return refused("principal moment of inertia ", axis, " = ", moment,
                     " kg m^2 must be at most the sum of the other two, ", others,
                     " kg m^2 (triangle inequality)");
    }
  }
  return absl::OkStatus();
}

absl::Status surface_check(const BodyProperties& p) {
  if (p.surface) {
    if (absl::Status status = surface_check(*p.surface); !status.ok()) return status;
  }
  if (absl::Status status = bounded("friction", p.friction, 0, kNoBound); !status.ok()) return status;
  if (absl::Status status = bounded("restitution", p.restitution, 0, 1); !status.ok()) return status;
  if (absl::Status status = bounded("linear damping", p.linear_damping, 0, 1); !status.ok()) return status;
  return bounded("angular damping", p.angular_damping, 0, 1);
}

absl::Status lasting_check(const LastingForce& lasting) {
  absl::Status status = finite("lasting force", Eigen::Vector3d(lasting.wrench.force.data()), kForceMax, "N");
  if (!status.ok()) return status;
  return finite("lasting torque", Eigen::Vector3d(lasting.wrench.torque.data()), kTorqueMax, "N m");
}

absl::Status properties_check(const BodyProperties& p) {
  if (p.motion > Motion::kKinematic) {
    return refused("motion = ", static_cast<int>(p.motion), " must be static, dynamic or kinematic");
  }
  if (p.motion == Motion::kDynamic) {
    if (absl::Status status = bounded("mass", p.mass, kMassMin, kMassMax, "kg"); !status.ok()) return status;
    if (absl::Status status = inertia_check(p.inertia); !status.ok()) return status;
  }
  const Pose centre = centre_frame(p);
  if (absl::Status status = finite("centre of mass", centre.position, kStaticExtentMax, "m"); !status.ok()) {
    return status;
  }
  if (absl::Status status = unit_quaternion("principal axes", centre.orientation); !status.ok())
    return status;
  if (p.lasting) {
    if (absl::Status status = lasting_check(*p.lasting); !status.ok()) return status;
  }
  return surface_check(p);
}

absl::Status motion_check(const BodyDescription& body, const WorldSettings& settings) {
  const double sector_size = settings.sector_size;
  const WorldPosition& position = body.pose.position;
  if (absl::Status status = known_frame(position.sector, settings); !status.ok()) return status;
  if (absl::Status status = finite("pose", position.local); !status.ok()) return status;
  if (auto home = canonical(position.sector, position.local, sector_size); !home.ok()) return home.status();
  if (absl::Status status = unit_quaternion("pose", body.pose.orientation); !status.ok()) return status;
  if (absl::Status status = finite("linear velocity", body.linear_velocity, kSpeedMax, "m/s"); !status.ok()) {
    return status;
  }
  absl::Status status = finite("angular velocity", body.angular_velocity, kAngularSpeedMax, "rad/s");
  if (!status.ok()) return status;
  if (body.properties.motion == Motion::kStatic &&
      (!body.linear_velocity.isZero(0) || !body.angular_velocity.isZero(0))) {
    return refused("the velocity of a static body must be 0");
  }
  return absl::OkStatus();
}

absl::Status gravity_check(const Gravity& gravity, double sector_size) {
  if (const auto* uniform = std::get_if<UniformGravity>(&gravity)) {
    if (absl::Status status = finite("gravity", uniform->acceleration); !status.ok()) return status;
    return bounded("gravity", uniform->acceleration.norm(), 0, kAccelerationMax, "m/s^2");
  }
  const CentralGravity& planet = std::get<CentralGravity>(gravity);
  if (absl::Status status = bounded("central gravity: surface", planet.surface, 0, kAccelerationMax, "m/s^2");
      !status.ok()) {
    return status;
  }
  absl::Status status = bounded("central gravity: radius", planet.radius, kExtentMin, kNoBound, "m");
  if (!status.ok()) return status;
  if (status = finite("central gravity: centre", planet.centre.local); !status.ok()) return status;
  return in("central gravity: centre",
            canonical(planet.centre.sector, planet.centre.local, sector_size).status());
}

absl::Status within_bounds(const WorldSetting& setting, const WorldSettings& settings) {
  return std::visit(
      [&](const auto member) -> absl::Status {
        using Value = std::remove_cvref_t<decltype(settings.*member)>;
        const Value value = settings.*member;
        if constexpr (std::is_enum_v<Value>) {
          if (std::ranges::find(all_of(value), value) != all_of(value).end()) return absl::OkStatus();
          return refused(setting.name, " = ", static_cast<int>(value), " must be ", bounds_of(setting));
        } else if constexpr (std::is_same_v<Value, bool>) {
          return absl::OkStatus();
        } else {
          return bounded(setting.name, static_cast<double>(value), setting.least, setting.most, setting.unit);
        }
      },
      setting.member);
}

absl::Status modules_check(const ProgramModules& modules) {
  if (modules.size() > kModulesMax)
    return refused("modules: their number ", modules.size(), " must be at most ", kModulesMax);
  for (auto one = modules.begin(); one != modules.end(); ++one) {
    const bool is_again =
        std::any_of(modules.begin(), one, [&](const auto& m) { return m->kind == (*one)->kind; });
    if (is_again) return refused("modules: ", (*one)->kind, " is given twice");
  }
  return absl::OkStatus();
}

absl::Status precision_check(const WorldSettings& settings) {
  const double limit = precision_limit(settings.precision);
  if (settings.sector_size <= limit) return absl::OkStatus();
  const bool single = settings.precision == Precision::kFloat32;
  return refused("sector_size = ", settings.sector_size, " m must be at most 2 r / (3 sqrt(3)) = ", limit,
                 " m in precision ", name_of(settings.precision), ", where neighbouring numbers are at most ",
                 kResolutionWanted, " m apart up to r = ", limit * 1.5 * std::sqrt(3.0), " m",
                 single ? "; use a smaller sector_size or precision f64" : "");
}

absl::Status sizes_check(const WorldDescription& world) {
  if (world.bodies.size() > kBodiesMax) {
    return refused("the world's ", world.bodies.size(), " bodies must be at most ", kBodiesMax);
  }
  if (world.shapes.size() > kShapesMax) {
    return refused("the world's ", world.shapes.size(), " shapes must be at most ", kShapesMax);
  }
  if (world.frames.size() > kFramesMax) {
    return refused("the world's ", world.frames.size(), " frames must be at most ", kFramesMax);
  }
  if (world.joints.size() > kJointsMax) {
    return refused("the world's ", world.joints.size(), " joints must be at most ", kJointsMax);
  }
  return absl::OkStatus();
}

std::string title(const BodyDescription& body) { return absl::StrCat("body '", body.name, "'"); }

absl::Status shapes_check(const WorldDescription& world) {
  absl::flat_hash_map<ShapeId, const BodyDescription*> first_user;
  for (const BodyDescription& body : world.bodies) first_user.try_emplace(body.properties.shape, &body);
  for (std::size_t id = 0; id < world.shapes.size(); ++id) {
    const auto user = first_user.find(static_cast<ShapeId>(id));
    const std::string name = user == first_user.end()
                                 ? absl::StrCat("shape ", id)
                                 : absl::StrCat("shape ", id, " of ", title(*user->second));
    if (absl::Status status = validate(world.shapes[id], name); !status.ok()) return status;
  }
  return absl::OkStatus();
}

std::string parent_name(const MovingFrame& frame, const WorldSettings& settings) {
  if (frame.parent() == kWorldFrame) return "the world frame";
  return absl::StrCat("the frame '", settings.frames[frame.parent() - 1].name, "'");
}

absl::Status carriers_check(const WorldDescription& world) {
  for (const MovingFrame& frame : world.settings.frames) {
    if (!frame.carrier) continue;
    const std::string what = absl::StrCat("frame '", frame.name, "'");
    const std::uint64_t place = frame.carrier->body.value;
    if (place == 0 || place > world.bodies.size())
      return refused(what, ": carrier ", place, " must be from 1 to ", world.bodies.size(), ", the bodies");
    const BodyDescription& body = world.bodies[place - 1];
    if (body.properties.motion == Motion::kStatic)
      return refused(what, ": its carrier, ", title(body), ", must be dynamic or kinematic");
    if (body.pose.position.sector.frame != frame.parent())
      return refused(what, ": its carrier, ", title(body), ", must be in ",
                     parent_name(frame, world.settings));
  }
  return absl::OkStatus();
}

// `names`: of the bodies.
absl::Status named_frames_check(const WorldDescription& world, absl::flat_hash_set<absl::string_view> names) {
  for (const FrameDescription& frame : world.frames) {
    const std::string what = absl::StrCat("frame '", frame.name, "'");
    if (absl::Status status = validate(frame, world.bodies.size()); !status.ok()) return in(what, status);
    if (!names.insert(frame.name).second)
      return refused(what, ": the name must be unique, but another frame or a body has it");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status validate(const FrameDescription& frame, std::size_t bodies) {
  if (frame.name.empty()) return refused("a frame's name must not be empty");
  if (frame.name.size() > kNameBytesMax) {
    return refused("frame '", frame.name.substr(0, 40), "...': the name's ", frame.name.size(),
                   " bytes must be at most ", kNameBytesMax);
  }
  if (absl::Status status = utf8("frame", frame.name); !status.ok()) return status;
  if (frame.body >= bodies)
    return refused("body ", frame.body, " must be below the number of bodies, ", bodies);
  if (absl::Status status = finite("position", frame.pose.position, kFrameReachMax, "m"); !status.ok())
    return status;
  return unit_quaternion("orientation", frame.pose.orientation);
}

double precision_limit(Precision precision) {
  const int digits = precision == Precision::kFloat32 ? std::numeric_limits<float>::digits
                                                      : std::numeric_limits<double>::digits;
  // Below 2^e, neighbouring numbers of d binary digits are at most 2^(e - d) apart.
  const double r = std::ldexp(kResolutionWanted, digits);
  return 2 * r / (3 * std::sqrt(3.0));
}

absl::Status validate(const WorldSettings& settings) {
  const std::string what = "settings";
  for (const WorldSetting& setting : kSettings) {
    if (absl::Status status = within_bounds(setting, settings); !status.ok()) return in(what, status);
  }
  if (absl::Status status = precision_check(settings); !status.ok()) return in(what, status);
  if (absl::Status status = modules_check(settings.modules); !status.ok()) return in(what, status);
  absl::Status status = gravity_check(settings.gravity, settings.sector_size);
  if (status.ok()) status = validate_frames(settings);
  return in(what, status);
}

absl::Status known_frame(const SectorIndex& sector, const WorldSettings& settings) {
  if (sector.frame <= settings.frames.size()) return absl::OkStatus();
  return refused("frame ", sector.frame, " must be at most ", settings.frames.size(),
                 ", the number of frames of the world that move");
}

absl::Status carrier_home(const SectorIndex& sector, BodyId body, const WorldSettings& settings) {
  for (const MovingFrame& frame : settings.frames) {
    if (frame.carrier && frame.carrier->body == body && sector.frame != frame.parent()) {
      return refused("it carries the frame '", frame.name, "', and stays in ", parent_name(frame, settings));
    }
  }
  return absl::OkStatus();
}

absl::Status validate(const Shape& shape, const std::string& name) {
  if (shape.parts.empty()) return refused(name, ": 0 parts must be at least 1");
  if (shape.parts.size() > kShapePartsMax) {
    return refused(name, ": ", shape.parts.size(), " parts must be at most ", kShapePartsMax);
  }
  for (std::size_t n = 0; n < shape.parts.size(); ++n) {
    absl::Status status = part_check(shape.parts[n]);
    if (!status.ok()) return in(absl::StrCat(name, ": part ", n), status);
  }
  return absl::OkStatus();
}

absl::Status validate(const BodyDescription& body, const Shape& shape, const WorldSettings& settings) {
  if (body.name.empty()) return refused("a body's name must not be empty");
  if (body.name.size() > kNameBytesMax) {
    return refused("body '", body.name.substr(0, 40), "...': the name's ", body.name.size(),
                   " bytes must be at most ", kNameBytesMax);
  }
  if (absl::Status status = utf8("body", body.name); !status.ok()) return status;
  if (absl::Status status = sized("user data", body.user_data, kUserDataBytesMax); !status.ok())
    return in(title(body), status);
  const BodyProperties& properties = body.properties;
  if (absl::Status status = properties_check(properties); !status.ok()) return in(title(body), status);
  if (settings.seams == SeamPolicy::kClone && (properties.trigger || has_triggers(shape)))
    return refused(title(body), ": a trigger needs the seam policy island; that of the world is clone");
  if (absl::Status status = motion_check(body, settings); !status.ok()) return in(title(body), status);
  if (properties.motion == Motion::kStatic)
    return in(title(body), static_shape_check(shape, settings.sector_size));
  return in(title(body), moving_shape_check(properties, shape, settings.sector_size));
}

absl::Status validate(const WorldDescription& world) {
  if (absl::Status status = validate(world.settings); !status.ok()) return status;
  if (absl::Status status = utf8("world", world.name); !status.ok()) return status;
  if (absl::Status status = sizes_check(world); !status.ok()) return status;
  if (absl::Status status = shapes_check(world); !status.ok()) return status;
  absl::flat_hash_set<absl::string_view> names;
  names.reserve(world.bodies.size());
  for (const BodyDescription& body : world.bodies) {
    const ShapeId shape = body.properties.shape;
    if (shape >= world.shapes.size()) {
      return refused(title(body), ": shape ", shape, " must be below the number of shapes, ",
                     world.shapes.size());
    }
    if (absl::Status status = validate(body, world.shapes[shape], world.settings); !status.ok())
      return status;
    if (!names.insert(body.name).second) {
      return refused(title(body), ": the name must be unique, but two bodies have it");
    }
  }
  if (absl::Status status = named_frames_check(world, std::move(names)); !status.ok()) return status;
  if (absl::Status status = carriers_check(world); !status.ok()) return status;
  return validate_joints(world);
}

}  // namespace tessera
