#include "worlds/loader/collision_shape.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <ignition/math/eigen3/Conversions.hh>
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

#include "lpss/model/limits.h"

namespace tessera {
namespace {

using ignition::math::eigen3::convert;

constexpr absl::string_view kHeightFieldPrefix = "tessera:heightfield/";

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
absl::StatusOr<std::vector<SubMesh>> chosen_objects(const sdf::Mesh& mesh, const std::vector<SubMesh>& all) {
  std::vector<SubMesh> chosen;
  for (const SubMesh& part : all) {
    if (mesh.Submesh().empty() || mesh.Submesh() == part.name) chosen.push_back(part);
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

std::vector<Geometry> surface_of_mesh(const sdf::Mesh& mesh, const std::vector<SubMesh>& objects,
                                      const std::string& where, Notices& notices) {
  const ignition::math::Vector3d scale = mesh.Scale();
  TriangleMesh surface = surface_of(objects, scale.X() * scale.Y() * scale.Z() < 0);
  const std::size_t flat = triangles_without_area(surface);
  if (3 * flat == surface.indices.size()) {
    notices.count_repair("mesh whose triangles have no area, left out", where);
    return {};
  }
  if (flat > 0) notices.count("triangle without area in a mesh: nothing touches it", flat);
  std::vector<Geometry> result;
  result.emplace_back(std::move(surface));
  return result;
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

absl::StatusOr<std::vector<Geometry>> geometries_of_mesh(const sdf::Mesh& mesh, bool moves,
                                                         const std::string& where, MeshLibrary& meshes,
                                                         Notices& notices) {
  if (const HeightField* field = meshes.height_field(mesh.Uri()); field != nullptr) {
    return std::vector<Geometry>{*field};
  }
  const absl::StatusOr<const std::vector<SubMesh>*> all = meshes.mesh(mesh.Uri());
  if (!all.ok()) return all.status();
  const absl::StatusOr<std::vector<SubMesh>> objects = chosen_objects(mesh, **all);
  if (!objects.ok()) return objects.status();
  if (!moves) return surface_of_mesh(mesh, *objects, where, notices);
  std::vector<Geometry> result;
  for (const SubMesh& part : *objects) {
    if (std::optional<ConvexHull> hull = hull_of(part, where, notices)) result.emplace_back(*std::move(hull));
  }
  return result;
}

// Empty for an unsupported kind.
absl::StatusOr<std::vector<Geometry>> geometries_of(const sdf::Geometry& geometry, bool moves,
                                                    const std::string& where, MeshLibrary& meshes,
                                                    Notices& notices) {
  switch (geometry.Type()) {
    case sdf::GeometryType::BOX:
      return std::vector<Geometry>{Box{convert(geometry.BoxShape()->Size())}};
    case sdf::GeometryType::SPHERE:
      return std::vector<Geometry>{Sphere{geometry.SphereShape()->Radius()}};
    case sdf::GeometryType::CAPSULE:
      return std::vector<Geometry>{
          Capsule{geometry.CapsuleShape()->Radius(), geometry.CapsuleShape()->Length()}};
    case sdf::GeometryType::CYLINDER:
      return std::vector<Geometry>{
          Cylinder{geometry.CylinderShape()->Radius(), geometry.CylinderShape()->Length()}};
    case sdf::GeometryType::ELLIPSOID:
      return std::vector<Geometry>{Ellipsoid{convert(geometry.EllipsoidShape()->Radii())}};
    case sdf::GeometryType::PLANE:
      return std::vector<Geometry>{Plane{convert(geometry.PlaneShape()->Normal()).normalized()}};
    case sdf::GeometryType::MESH:
      return geometries_of_mesh(*geometry.MeshShape(), moves, where, meshes, notices);
    default:
      notices.count("collision with unsupported geometry, skipped");
      return std::vector<Geometry>{};
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

std::string MeshLibrary::add(HeightField field) {
  std::string name = absl::StrCat(kHeightFieldPrefix, height_fields_.size());
  height_fields_.emplace(name, std::move(field));
  return name;
}

const HeightField* MeshLibrary::height_field(const std::string& name) const {
  if (!absl::StartsWith(name, kHeightFieldPrefix)) return nullptr;
  const auto place = height_fields_.find(name);
  return place == height_fields_.end() ? nullptr : &place->second;
}

absl::StatusOr<Shape> shape_of(const sdf::Link& link, bool moves, MeshLibrary& meshes, Notices& notices) {
  Shape shape;
  for (std::uint64_t n = 0; n < link.CollisionCount(); ++n) {
    const sdf::Collision& collision = *link.CollisionByIndex(n);
    const std::string where =
        absl::StrCat("<collision name='", collision.Name(), "'> of <link name='", link.Name(), "'>");
    absl::StatusOr<std::vector<Geometry>> geometries =
        geometries_of(*collision.Geom(), moves, where, meshes, notices);
    if (!geometries.ok()) {
      return absl::Status(geometries.status().code(), absl::StrCat("collision '", collision.Name(),
                                                                   "': ", geometries.status().message()));
    }
    for (Geometry& geometry : *geometries)
      shape.parts.push_back({std::move(geometry), pose_in_link(collision)});
  }
  return shape;
}

}  // namespace tessera
