#include "worlds/loader/collision_shape.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <ignition/math/eigen3/Conversions.hh>
#include <iterator>
#include <optional>
#include <sdf/Box.hh>
#include <sdf/Capsule.hh>
#include <sdf/Collision.hh>
#include <sdf/Cylinder.hh>
#include <sdf/Ellipsoid.hh>
#include <sdf/Geometry.hh>
#include <sdf/Mesh.hh>
#include <sdf/Plane.hh>
#include <sdf/Sphere.hh>
#include <utility>
#include <variant>

#include "lpss/model/limits.h"
#include "worlds/loader/visuals.h"

namespace tessera {
namespace {

using ignition::math::eigen3::convert;

constexpr absl::string_view kGivenPrefix = "tessera:given/";
constexpr std::uint32_t kPlainColour = 0xb3b3b3;  // of what has none

using Parts = std::vector<ShapePart>;  // in the frame of a collision

Parts one(Geometry geometry) { return {{std::move(geometry), Pose{}}}; }

Pose pose_in_link(const sdf::Collision& collision) {
  ignition::math::Pose3d pose = collision.RawPose();
  // Only if a frame is named: the conversion through the model and back rounds, so equal shapes would differ.
  // That the frame exists was checked when the model was loaded.
  if (!collision.PoseRelativeTo().empty() && !collision.SemanticPose().Resolve(pose).empty()) {
    pose = collision.RawPose();
  }
  return {convert(pose.Pos()), convert(pose.Rot()).normalized()};
}

// The chosen objects of a mesh file, scaled, and centred if the file requests it.
absl::StatusOr<std::vector<SubMesh>> chosen_objects(const sdf::Mesh& mesh, const std::string& file,
                                                    MeshLibrary& meshes) {
  const absl::StatusOr<const std::vector<SubMesh>*> all = meshes.mesh(file);
  if (!all.ok()) return all.status();
  std::vector<SubMesh> chosen;
  for (const SubMesh& part : **all) {
    const std::string& name = mesh.Submesh();
    if (name.empty() || name == part.name || name == part.geometry) chosen.push_back(part);
  }
  if (chosen.empty()) {
    return absl::NotFoundError(
        absl::StrCat("mesh ", mesh.Uri(), ": it has no submesh '", mesh.Submesh(), "'"));
  }
  const Eigen::Vector3d scale = convert(mesh.Scale());
  if (!scale.allFinite() || (scale.array() == 0).any()) {
    return absl::InvalidArgumentError(absl::StrCat("mesh ", mesh.Uri(), ": scale ", scale.x(), " ", scale.y(),
                                                   " ", scale.z(), " must be finite and not 0"));
  }
  Eigen::AlignedBox3d box;
  for (SubMesh& part : chosen) {
    for (Eigen::Vector3d& vertex : part.vertices) {
      vertex = vertex.cwiseProduct(scale);
      box.extend(vertex);
    }
  }
  if (mesh.CenterSubmesh()) {
    for (SubMesh& part : chosen) {
      for (Eigen::Vector3d& vertex : part.vertices) vertex -= box.center();
    }
  }
  return chosen;
}

TriangleMesh surface_of(const std::vector<SubMesh>& objects, bool mirrored) {
  TriangleMesh result;
  for (const SubMesh& part : objects) {
    const auto first = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.insert(result.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (std::size_t n = 0; n < part.indices.size(); n += 3) {
      // A mirror turns triangles inside out.
      const std::size_t second = mirrored ? n + 2 : n + 1;
      const std::size_t third = mirrored ? n + 1 : n + 2;
      for (std::size_t corner : {n, second, third}) result.indices.push_back(first + part.indices[corner]);
    }
  }
  return result;
}

// Triangles less high than this fraction of their longest side have no area.
constexpr double kFlatTriangle = 1e-6;

std::size_t triangles_without_area(const TriangleMesh& mesh) {
  std::size_t flat = 0;
  for (std::size_t n = 0; n < mesh.indices.size(); n += 3) {
    const Eigen::Vector3d& a = mesh.vertices[mesh.indices[n]];
    const Eigen::Vector3d ab = mesh.vertices[mesh.indices[n + 1]] - a;
    const Eigen::Vector3d ac = mesh.vertices[mesh.indices[n + 2]] - a;
    const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    if (ab.cross(ac).norm() <= kFlatTriangle * longest) ++flat;
  }
  return flat;
}

bool is_mirrored(const sdf::Mesh& mesh) {
  const ignition::math::Vector3d scale = mesh.Scale();
  return scale.X() * scale.Y() * scale.Z() < 0;
}

Parts surface_of_mesh(const sdf::Mesh& mesh, const std::vector<SubMesh>& objects, const std::string& where,
                      Notices& notices) {
  TriangleMesh surface = surface_of(objects, is_mirrored(mesh));
  const std::size_t flat = triangles_without_area(surface);
  if (3 * flat == surface.indices.size()) {
    notices.count_repair("mesh whose triangles have no area, left out", where);
    return {};
  }
  if (flat > 0) notices.count("triangle without area in a mesh: nothing touches it", flat);
  return one(std::move(surface));
}

// The hull of one object of a mesh; none if its points are all near a line.
std::optional<ConvexHull> hull_of(const SubMesh& part, const std::string& where, Notices& notices) {
  ConvexHull hull{hull_points(part.vertices, kHullPointsMax)};
  const Slab slab = slab_around(hull.points);
  if (slab.width < kExtentMin) {
    notices.count_repair("mesh object whose points are all on a line, left out", where);
    return std::nullopt;
  }
  if (slab.thickness < kExtentMin) {
    notices.count_repair(absl::StrCat("mesh object that is flat, made ", 2 * kExtentMin, " m thick"), where);
    const std::vector<Eigen::Vector3d> flat = hull_points(part.vertices, kHullPointsMax / 2);
    hull.points.clear();
    for (const Eigen::Vector3d& point : flat) {
      hull.points.push_back(point - kExtentMin * slab.normal);
      hull.points.push_back(point + kExtentMin * slab.normal);
    }
  }
  if (part.vertices.size() > kHullPointsMax && hull.points.size() < part.vertices.size()) {
    notices.count("mesh object simplified for its convex hull");
  }
  return hull;
}

// The hulls of the parts of an object; none if it cannot be divided.
Parts hulls_of_parts(const SubMesh& object, std::size_t parts_max, const std::string& where,
                     MeshLibrary& meshes, Notices& notices) {
  Parts result;
  const std::size_t triangles = object.indices.size() / 3;
  if (triangles <= kDividedTrianglesMax && !meshes.may_divide(triangles)) {
    notices.count(absl::StrCat("mesh object not divided into convex parts, as those before had ",
                               kDividedTrianglesInAll, " triangles, taken as its convex hull"));
    return result;
  }
  const auto divided = tessera::divided(object, parts_max);
  if (!divided) {
    notices.count(absl::StrCat("mesh object that cannot be divided into convex parts (of more than ",
                               kDividedTrianglesMax,
                               " triangles, in many pieces, or no surface), taken as its convex hull"));
    return result;
  }
  for (const std::vector<Eigen::Vector3d>& points : *divided) {
    SubMesh part;
    part.vertices = points;
    if (std::optional<ConvexHull> hull = hull_of(part, where, notices))
      result.push_back({*std::move(hull), Pose{}});
  }
  return result;
}

absl::StatusOr<Parts> parts_of_mesh(const sdf::Mesh& mesh, const std::string& file, std::size_t parts_max,
                                    bool moves, const std::string& where, MeshLibrary& meshes,
                                    Notices& notices) {
  const absl::StatusOr<std::vector<SubMesh>> objects = chosen_objects(mesh, file, meshes);
  if (!objects.ok()) return objects.status();
  if (!moves) return surface_of_mesh(mesh, *objects, where, notices);
  Parts result;
  for (const SubMesh& object : *objects) {
    Parts parts;
    if (!is_convex(object)) {
      if (parts_max > 1) {
        parts = hulls_of_parts(object, parts_max, where, meshes, notices);
      } else {
        notices.count("concave mesh object that moves, taken as its convex hull");
      }
    }
    if (parts.empty()) {
      if (std::optional<ConvexHull> hull = hull_of(object, where, notices)) parts = one(*std::move(hull));
    }
    std::ranges::move(parts, std::back_inserter(result));
  }
  return result;
}

// A hull where the outline is convex; else a surface, or, of what moves, the hulls of its convex parts.
absl::StatusOr<Parts> parts_of_prisms(const Prisms& prisms, bool moves) {
  Parts result;
  for (const Prism& prism : prisms) {
    const absl::StatusOr<std::vector<Outline>> convex = convex_parts(prism.outline);
    if (!convex.ok()) return convex.status();
    if (!moves && convex->size() > 1) {
      absl::StatusOr<TriangleMesh> surface = prism_surface(prism);
      if (!surface.ok()) return surface.status();
      result.push_back({*std::move(surface), Pose{}});
      continue;
    }
    for (const Outline& part : *convex) result.push_back({prism_hull(part, prism.height), Pose{}});
  }
  return result;
}

absl::StatusOr<Parts> parts_of_mesh(const sdf::Mesh& mesh, bool moves, const std::string& where,
                                    MeshLibrary& meshes, Notices& notices) {
  const GivenGeometry* const given = meshes.given(mesh.Uri());
  if (given == nullptr) return parts_of_mesh(mesh, mesh.Uri(), 0, moves, where, meshes, notices);
  if (const auto* field = std::get_if<PlacedHeightField>(given))
    return Parts{{field->field, Pose{field->position, Eigen::Quaterniond::Identity()}}};
  if (const auto* prisms = std::get_if<Prisms>(given)) return parts_of_prisms(*prisms, moves);
  if (const auto* cone = std::get_if<Cone>(given)) return one(cone->hull);
  if (const auto* ground = std::get_if<Ground>(given)) return one(*ground);
  const auto& divided = std::get<DividedMesh>(*given);
  return parts_of_mesh(mesh, divided.file, divided.parts_max, moves, where, meshes, notices);
}

// Empty for an unsupported kind.
absl::StatusOr<Parts> parts_of(const sdf::Geometry& geometry, bool moves, const std::string& where,
                               MeshLibrary& meshes, Notices& notices) {
  switch (geometry.Type()) {
    case sdf::GeometryType::BOX:
      return one(Box{convert(geometry.BoxShape()->Size())});
    case sdf::GeometryType::SPHERE:
      return one(Sphere{geometry.SphereShape()->Radius()});
    case sdf::GeometryType::CAPSULE:
      return one(Capsule{geometry.CapsuleShape()->Radius(), geometry.CapsuleShape()->Length()});
    case sdf::GeometryType::CYLINDER:
      return one(Cylinder{geometry.CylinderShape()->Radius(), geometry.CylinderShape()->Length()});
    case sdf::GeometryType::ELLIPSOID:
      return one(Ellipsoid{convert(geometry.EllipsoidShape()->Radii())});
    case sdf::GeometryType::PLANE:
      return one(Plane{convert(geometry.PlaneShape()->Normal()).normalized()});
    case sdf::GeometryType::MESH:
      return parts_of_mesh(*geometry.MeshShape(), moves, where, meshes, notices);
    default:
      notices.count("collision with unsupported geometry, skipped");
      return Parts{};
  }
}

}  // namespace

absl::StatusOr<const std::vector<SubMesh>*> MeshLibrary::mesh(const std::string& file) {
  std::unique_ptr<std::vector<SubMesh>>& entry = meshes_[file];
  if (entry == nullptr) {
    absl::StatusOr<std::vector<SubMesh>> read = read_mesh_file(file);
    if (!read.ok()) return read.status();
    entry = std::make_unique<std::vector<SubMesh>>(*std::move(read));
  }
  return entry.get();
}

bool MeshLibrary::may_divide(std::size_t triangles) {
  if (divided_triangles_ + triangles > kDividedTrianglesInAll) return false;
  divided_triangles_ += triangles;
  return true;
}

std::string MeshLibrary::add(GivenGeometry geometry) {
  std::string name = absl::StrCat(kGivenPrefix, given_.size());
  if (const auto* mesh = std::get_if<DividedMesh>(&geometry)) {
    const auto [known, is_new] = divided_.try_emplace({mesh->file, mesh->parts_max}, name);
    if (!is_new) return known->second;
  }
  given_.emplace(name, std::move(geometry));
  return name;
}

const GivenGeometry* MeshLibrary::given(const std::string& name) const {
  if (!absl::StartsWith(name, kGivenPrefix)) return nullptr;
  const auto place = given_.find(name);
  return place == given_.end() ? nullptr : &place->second;
}

absl::StatusOr<TriangleMesh> surface_of_file(const sdf::Mesh& mesh, MeshLibrary& meshes) {
  std::string file = mesh.Uri();
  if (const GivenGeometry* const given = meshes.given(file)) {
    const auto* const divided = std::get_if<DividedMesh>(given);
    if (divided == nullptr) return TriangleMesh{};
    file = divided->file;
  }
  const absl::StatusOr<std::vector<SubMesh>> objects = chosen_objects(mesh, file, meshes);
  if (!objects.ok()) return objects.status();
  return surface_of(*objects, is_mirrored(mesh));
}

absl::StatusOr<Look> look_of(const sdf::Link& link, MeshLibrary& meshes, Notices& notices) {
  Look look;
  std::size_t triangles = 0;
  const auto add = [&](ShapePart part, const Pose& pose, std::uint32_t colour) {
    look.shape.parts.push_back({std::move(part.geometry), pose * part.pose});
    look.colours.push_back(colour);
  };
  for (std::uint64_t n = 0; n < link.CollisionCount(); ++n) {
    const sdf::Collision& visual = *link.CollisionByIndex(n);
    if (!was_visual(visual.Name())) continue;
    const std::optional<std::uint32_t> colour = colour_of_visual(visual.Name());
    const sdf::Mesh* const mesh = visual.Geom()->MeshShape();
    const Pose pose = pose_in_link(visual);
    if (mesh == nullptr || meshes.given(mesh->Uri()) != nullptr) {
      absl::StatusOr<Parts> parts = parts_of(*visual.Geom(), /*moves=*/false, visual.Name(), meshes, notices);
      if (!parts.ok()) return parts.status();
      for (ShapePart& part : *parts) add(std::move(part), pose, colour.value_or(kPlainColour));
      continue;
    }
    const absl::StatusOr<std::vector<SubMesh>> objects = chosen_objects(*mesh, mesh->Uri(), meshes);
    if (!objects.ok()) return objects.status();
    for (const SubMesh& object : *objects) {
      triangles += object.indices.size() / 3;
      add({surface_of({object}, is_mirrored(*mesh)), Pose{}}, pose,
          colour.value_or(object.colour.value_or(kPlainColour)));
    }
  }
  if (triangles <= kLookTrianglesMax) return look;
  notices.count(absl::StrCat("link whose visuals have more than ", kLookTrianglesMax,
                             " triangles, shown as its collisions"));
  return Look{};
}

absl::StatusOr<Shape> shape_of(const sdf::Link& link, bool moves, const std::vector<PartMaterial>& materials,
                               MeshLibrary& meshes, Notices& notices) {
  Shape shape;
  bool differ = false;
  for (std::uint64_t n = 0; n < link.CollisionCount(); ++n) {
    const sdf::Collision& collision = *link.CollisionByIndex(n);
    const std::string where =
        absl::StrCat("<collision name='", collision.Name(), "'> of <link name='", link.Name(), "'>");
    absl::StatusOr<Parts> parts = parts_of(*collision.Geom(), moves, where, meshes, notices);
    if (!parts.ok()) {
      return absl::Status(parts.status().code(),
                          absl::StrCat("collision '", collision.Name(), "': ", parts.status().message()));
    }
    const Pose pose = pose_in_link(collision);
    for (ShapePart& part : *parts) {
      shape.parts.push_back({std::move(part.geometry), part.pose.is_identity() ? pose : pose * part.pose});
      shape.parts.back().material = materials[n];
    }
    differ = differ || (!parts->empty() && materials[n] != materials.front());
  }
  for (ShapePart& part : shape.parts) {
    if (!differ) {
      part.material.reset();
      continue;
    }
    Eigen::Map<Eigen::Vector3d> direction(part.material->surface.direction.data());
    direction = (part.pose.orientation.conjugate() * direction).eval();
  }
  return shape;
}

}  // namespace tessera
