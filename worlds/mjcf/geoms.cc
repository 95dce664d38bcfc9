#include "worlds/mjcf/geoms.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "lpss/model/limits.h"
#include "worlds/loader/mesh_file.h"

namespace tessera::mjcf {
namespace {

using Eigen::Vector3d;

std::string geom_title(const mjModel& model, int geom) {
  const std::string name = name_at(model, model.name_geomadr, geom);
  return name.empty() ? absl::StrCat("<geom> ", geom) : absl::StrCat("<geom name='", name, "'>");
}

std::vector<Vector3d> vertices_of(const mjModel& model, int mesh) {
  std::vector<Vector3d> result;
  const float* at = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
  for (int n = 0; n < model.mesh_vertnum[mesh]; ++n, at += 3) result.emplace_back(at[0], at[1], at[2]);
  return result;
}

// Those of its hull, where MuJoCo has made one: the number of them, that of faces, a list of as many places,
// and then which vertices they are.
std::vector<Vector3d> hull_vertices(const mjModel& model, int mesh) {
  std::vector<Vector3d> all = vertices_of(model, mesh);
  if (model.mesh_graphadr[mesh] < 0) return all;
  const int* const graph = model.mesh_graph + model.mesh_graphadr[mesh];
  const int* const places = graph + 2 + graph[0];
  std::vector<Vector3d> result;
  for (int n = 0; n < graph[0]; ++n) result.push_back(all[static_cast<std::size_t>(places[n])]);
  return result;
}

HeightField height_field_of(const mjModel& model, int field) {
  HeightField result;
  result.columns = static_cast<std::uint32_t>(model.hfield_ncol[field]);
  result.rows = static_cast<std::uint32_t>(model.hfield_nrow[field]);
  const mjtNum* const size = model.hfield_size + 4 * field;
  result.spacing = {2 * size[0] / (result.columns - 1), 2 * size[1] / (result.rows - 1)};
  const float* const data = model.hfield_data + model.hfield_adr[field];
  for (std::size_t n = 0; n < std::size_t{result.columns} * result.rows; ++n)
    result.heights.push_back(size[2] * data[n]);
  return result;
}

// A geom that is not one of a mesh or field, whose sizes are raised to the least.
Geometry primitive(int type, const Vector3d& size) {
  const auto length = [](double value) { return std::max(value, kExtentMin); };
  switch (type) {
    case mjGEOM_SPHERE:
      return Sphere{length(size[0])};
    case mjGEOM_CAPSULE:
      return Capsule{length(size[0]), length(2 * size[1])};
    case mjGEOM_CYLINDER:
      return Cylinder{length(size[0]), length(2 * size[1])};
    case mjGEOM_ELLIPSOID:
      return Ellipsoid{size.cwiseMax(kExtentMin)};
    default:
      return Box{(2 * size).cwiseMax(kExtentMin)};
  }
}

// Nothing for what a body of ours cannot have.
std::optional<Geometry> collider(const mjModel& model, int geom, bool moves, Notices& notices) {
  const int type = model.geom_type[geom];
  if (moves && (type == mjGEOM_PLANE || type == mjGEOM_HFIELD)) {
    notices.count_loss("plane or height field of a body that can move, left out");
    return std::nullopt;
  }
  if (type == mjGEOM_PLANE) return Plane{};
  if (type == mjGEOM_HFIELD) return height_field_of(model, model.geom_dataid[geom]);
  if (type != mjGEOM_MESH) return primitive(type, vector_at(model.geom_size + 3 * geom));
  ConvexHull hull{hull_points(hull_vertices(model, model.geom_dataid[geom]), kHullPointsMax)};
  if (hull.points.size() >= 4 && slab_around(hull.points).thickness >= kExtentMin) return hull;
  notices.count_repair("flat mesh, left out", geom_title(model, geom));
  return std::nullopt;
}

// Friction of an only point, of a patch, and of rolling, as far as the geom has them.
PartMaterial material_of(const mjModel& model, int geom, const ContactBits& bits, bool has_friction) {
  const mjtNum* const friction = model.geom_friction + 3 * geom;
  const int dimensions = model.geom_condim[geom];
  PartMaterial material;
  material.friction = has_friction ? friction[0] : 0;
  material.category = bits.category;
  material.mask = bits.mask;
  // A patch resists spinning by 3 pi / 16 times its radius.
  if (dimensions >= 4)
    material.surface.patch_radius = std::min(16 / (3 * std::numbers::pi) * friction[1], kPatchRadiusMax);
  if (dimensions >= 6) material.surface.rolling_friction = std::min(friction[2], kRollingFrictionMax);
  return material;
}

void note_contacts(const mjModel& model, int geom, Notices& notices) {
  if (model.geom_margin[geom] != 0 || model.geom_gap[geom] != 0)
    notices.count("'margin' or 'gap' of a <geom> skipped");
  if (model.geom_priority[geom] != 0)
    notices.count("'priority' of a <geom> skipped: a contact has the smaller friction of its two");
  constexpr mjtNum kReference[mjNREF] = {0.02, 1};
  constexpr mjtNum kImpedance[mjNIMP] = {0.9, 0.95, 0.001, 0.5, 2};
  if (!std::equal(kReference, kReference + mjNREF, model.geom_solref + mjNREF * geom) ||
      !std::equal(kImpedance, kImpedance + mjNIMP, model.geom_solimp + mjNIMP * geom))
    notices.count("'solref' or 'solimp' of a <geom> skipped: contacts are rigid");
  if (model.geom_fluid[mjNFLUID * geom] > 0) notices.count("'fluidshape' of a <geom> skipped");
}

void set_surface_of(const std::vector<PartMaterial>& materials, Shape& shape, BodyProperties& properties) {
  const PartMaterial& first = materials.front();
  properties.friction = first.friction;
  if (first.surface != Surface{}) properties.surface = first.surface;
  properties.category = 0;
  properties.mask = 0;
  for (const PartMaterial& material : materials) {
    properties.category |= material.category;
    properties.mask |= material.mask;
  }
  if (std::ranges::all_of(materials, [&](const PartMaterial& other) { return other == first; })) return;
  for (std::size_t n = 0; n < materials.size(); ++n) shape.parts[n].material = materials[n];
}

std::uint32_t colour_of(const mjModel& model, int geom) {
  const int material = model.geom_matid[geom];
  const float* const rgba = material >= 0 ? model.mat_rgba + 4 * material : model.geom_rgba + 4 * geom;
  std::uint32_t colour = 0;
  for (int n = 0; n < 3; ++n)
    colour = colour << 8 | static_cast<std::uint32_t>(std::lround(255 * std::clamp(rgba[n], 0.0F, 1.0F)));
  return colour;
}

TriangleMesh surface_of(const mjModel& model, int mesh) {
  TriangleMesh result{vertices_of(model, mesh), {}};
  const int* const faces = model.mesh_face + 3 * model.mesh_faceadr[mesh];
  for (int n = 0; n < 3 * model.mesh_facenum[mesh]; ++n)
    result.indices.push_back(static_cast<std::uint32_t>(faces[n]));
  return result;
}

}  // namespace

bool set_shape(const Model& model, const std::vector<ContactBits>& bits, const std::vector<PlacedGeom>& geoms,
               ShapeTable& shapes, BodyProperties& properties, Notices& notices) {
  const bool moves = properties.motion != Motion::kStatic;
  const bool has_friction =
      std::any_of(model->geom_condim, model->geom_condim + model->ngeom, [](int n) { return n > 1; });
  Shape shape;
  std::vector<PartMaterial> materials;
  for (const PlacedGeom& placed : geoms) {
    const ContactBits& own = bits[static_cast<std::size_t>(placed.geom)];
    if (own.category == 0) continue;
    std::optional<Geometry> geometry = collider(*model, placed.geom, moves, notices);
    if (!geometry) continue;
    note_contacts(*model, placed.geom, notices);
    shape.parts.push_back({*std::move(geometry), placed.pose});
    materials.push_back(material_of(*model, placed.geom, own, has_friction));
  }
  const bool collides = !shape.parts.empty();
  if (collides) {
    set_surface_of(materials, shape, properties);
  } else {
    constexpr double kPlaceholderRadius = 0.01;
    shape.parts.push_back({Sphere{kPlaceholderRadius}, Pose{}});
    properties.category = 0;
    properties.mask = 0;
  }
  properties.shape = shapes.add(std::move(shape));
  return collides;
}

Look look_of(const Model& model, const std::vector<PlacedGeom>& geoms) {
  constexpr int kShownGroupMax = 2;
  Look look;
  std::size_t triangles = 0;
  for (const PlacedGeom& placed : geoms) {
    const int type = model->geom_type[placed.geom];
    const int mesh = model->geom_dataid[placed.geom];
    if (model->geom_group[placed.geom] > kShownGroupMax || type == mjGEOM_PLANE || type == mjGEOM_HFIELD)
      continue;
    if (type == mjGEOM_MESH) {
      triangles += static_cast<std::size_t>(model->mesh_facenum[mesh]);
      if (triangles > kLookTrianglesMax) return {};
      look.shape.parts.push_back({surface_of(*model, mesh), placed.pose});
    } else {
      look.shape.parts.push_back(
          {primitive(type, vector_at(model->geom_size + 3 * placed.geom)), placed.pose});
    }
    look.colours.push_back(colour_of(*model, placed.geom));
  }
  return look;
}

}  // namespace tessera::mjcf
