#include "worlds/loader/convex_parts.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <hacdHACD.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <utility>

namespace tessera {
namespace {

constexpr double kFlat = 1e-9;  // of an area: what rounding leaves

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double double_area_of(const Outline& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return cross(points[b] - points[a], points[c] - points[a]);
}

// The outline in assimp's plainest format, around its middle, so that no digit of its shape is lost.
std::string as_obj(const Outline& outline) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : outline) box.extend(point);
  const double scale = 1 / std::max(box.sizes().maxCoeff(), 1e-300);
  std::string text;
  for (const Eigen::Vector2d& point : outline) {
    const Eigen::Vector2d at = (point - box.center()) * scale;
    absl::StrAppendFormat(&text, "v %.9g %.9g 0\n", at.x(), at.y());
  }
  text += "f";
  for (std::size_t n = 1; n <= outline.size(); ++n) absl::StrAppend(&text, " ", n);
  return text + "\n";
}

// Whether the corner at `at` of a counter-clockwise polygon is convex.
bool is_convex_corner(const Outline& points, const std::vector<std::uint32_t>& polygon, std::size_t at) {
  const std::size_t size = polygon.size();
  return double_area_of(points, polygon[(at + size - 1) % size], polygon[at], polygon[(at + 1) % size]) >= 0;
}

// Two counter-clockwise polygons as one, if they share an edge and it is convex there (Hertel and Mehlhorn,
// 1983).
std::optional<std::vector<std::uint32_t>> joined(const Outline& points, const std::vector<std::uint32_t>& p,
                                                 const std::vector<std::uint32_t>& q) {
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (std::size_t j = 0; j < q.size(); ++j) {
      if (p[i] != q[(j + 1) % q.size()] || p[(i + 1) % p.size()] != q[j]) continue;
      std::vector<std::uint32_t> both;
      for (std::size_t n = 1; n <= p.size(); ++n) both.push_back(p[(i + n) % p.size()]);
      for (std::size_t n = 2; n < q.size(); ++n) both.push_back(q[(j + n) % q.size()]);
      if (is_convex_corner(points, both, 0) && is_convex_corner(points, both, p.size() - 1)) return both;
    }
  }
  return std::nullopt;
}

// Its points, each once, and its triangles by them.
struct Welded {
  std::vector<HACD::Vec3<HACD::Real>> points;
  std::vector<HACD::Vec3<long>> triangles;
};

Welded welded(const SubMesh& object) {
  Welded result;
  std::map<std::tuple<double, double, double>, long> places;
  std::vector<long> place_of;
  for (const Eigen::Vector3d& v : object.vertices) {
    const auto [place, is_new] =
        places.try_emplace({v.x(), v.y(), v.z()}, static_cast<long>(result.points.size()));
    if (is_new) result.points.emplace_back(v.x(), v.y(), v.z());
    place_of.push_back(place->second);
  }
  for (std::size_t n = 0; n + 2 < object.indices.size(); n += 3) {
    const long a = place_of[object.indices[n]];
    const long b = place_of[object.indices[n + 1]];
    const long c = place_of[object.indices[n + 2]];
    if (a != b && b != c && c != a) result.triangles.emplace_back(a, b, c);
  }
  return result;
}

// Whether hardly an edge has more than two triangles.
bool is_surface(const Welded& mesh) {
  constexpr std::size_t kPairsMax =
      2;  // of triangles that share an edge, by triangle: 1.5 in a closed surface
  std::map<std::pair<long, long>, std::size_t> triangles_at;
  std::size_t pairs = 0;
  for (const HACD::Vec3<long>& t : mesh.triangles) {
    for (const auto& [a, b] : {std::pair(t.X(), t.Y()), std::pair(t.Y(), t.Z()), std::pair(t.Z(), t.X())})
      pairs += triangles_at[std::minmax(a, b)]++;
  }
  return pairs <= kPairsMax * mesh.triangles.size();
}

// The number of the part that each triangle belongs to, or none.
std::optional<std::vector<long>> parts_of_triangles(Welded& mesh, std::size_t parts_min, double concavity) {
  HACD::HACD hacd;
  hacd.SetPoints(mesh.points.data());
  hacd.SetNPoints(mesh.points.size());
  hacd.SetTriangles(mesh.triangles.data());
  hacd.SetNTriangles(mesh.triangles.size());
  hacd.SetCompacityWeight(0.1);
  hacd.SetVolumeWeight(0);
  hacd.SetNClusters(parts_min);
  hacd.SetConcavity(concavity);
  hacd.SetAddExtraDistPoints(true);
  hacd.SetAddFacesPoints(true);
  if (!hacd.Compute(/*fullCH=*/true)) return std::nullopt;
  return std::vector<long>(hacd.GetPartition(), hacd.GetPartition() + mesh.triangles.size());
}

}  // namespace

double double_area(const Outline& outline) {
  double area = 0;
  for (std::size_t n = 0; n < outline.size(); ++n)
    area += cross(outline[n] - outline[0], outline[(n + 1) % outline.size()] - outline[0]);
  return area;
}

absl::StatusOr<std::vector<std::uint32_t>> triangles_of(const Outline& outline) {
  const std::string text = as_obj(outline);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFileFromMemory(text.data(), text.size(), aiProcess_Triangulate, "obj");
  std::vector<std::uint32_t> triangles;
  double covered = 0;
  if (scene != nullptr && scene->mNumMeshes == 1 && scene->mMeshes[0]->mNumVertices == outline.size()) {
    const aiMesh& mesh = *scene->mMeshes[0];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;
      std::uint32_t corner[3];
      std::copy_n(mesh.mFaces[f].mIndices, 3, corner);
      const double area = double_area_of(outline, corner[0], corner[1], corner[2]);
      if (area < 0) std::swap(corner[1], corner[2]);
      covered += std::abs(area);
      triangles.insert(triangles.end(), corner, corner + 3);
    }
  }
  constexpr double kTolerance = 1e-5;  // assimp reads floats
  const double area = std::abs(double_area(outline));
  if (!(std::abs(covered - area) <= kTolerance * area))
    return absl::InvalidArgumentError("the outline crosses or touches itself");
  return triangles;
}

absl::StatusOr<std::vector<Outline>> convex_parts(const Outline& outline) {
  const absl::StatusOr<std::vector<std::uint32_t>> triangles = triangles_of(outline);
  if (!triangles.ok()) return triangles.status();
  const double least = kFlat * std::abs(double_area(outline));
  std::vector<std::vector<std::uint32_t>> polygons;
  for (std::size_t n = 0; n < triangles->size(); n += 3) {
    const std::uint32_t* const t = &(*triangles)[n];
    if (double_area_of(outline, t[0], t[1], t[2]) > least) polygons.push_back({t[0], t[1], t[2]});
  }
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    for (std::size_t p = 0; p < polygons.size(); ++p) {
      for (std::size_t q = p + 1; q < polygons.size(); ++q) {
        std::optional<std::vector<std::uint32_t>> both = joined(outline, polygons[p], polygons[q]);
        if (!both) continue;
        polygons[p] = *std::move(both);
        polygons.erase(polygons.begin() + static_cast<std::ptrdiff_t>(q));
        q = p;
        is_changed = true;
      }
    }
  }
  std::vector<Outline> parts;
  for (const std::vector<std::uint32_t>& polygon : polygons) {
    Outline& part = parts.emplace_back();
    for (const std::uint32_t point : polygon) part.push_back(outline[point]);
  }
  return parts;
}

bool is_convex(const SubMesh& object) {
  constexpr double kTolerance = 0.01;
  constexpr std::size_t kPairsMax = 100'000'000;
  if (object.vertices.size() * (object.indices.size() / 3) > kPairsMax) return false;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : object.vertices) box.extend(vertex);
  const double most = kTolerance * box.diagonal().norm();
  for (std::size_t n = 0; n + 2 < object.indices.size(); n += 3) {
    const Eigen::Vector3d& a = object.vertices[object.indices[n]];
    const Eigen::Vector3d normal = (object.vertices[object.indices[n + 1]] - a)
                                       .cross(object.vertices[object.indices[n + 2]] - a)
                                       .stableNormalized();
    double above = 0;
    double below = 0;
    for (const Eigen::Vector3d& vertex : object.vertices) {
      const double height = normal.dot(vertex - a);
      above = std::max(above, height);
      below = std::max(below, -height);
    }
    if (std::min(above, below) > most) return false;
  }
  return true;
}

std::optional<std::vector<std::vector<Eigen::Vector3d>>> divided(const SubMesh& object,
                                                                 std::size_t parts_max) {
  if (object.indices.size() / 3 > kDividedTrianglesMax) return std::nullopt;
  // HACD counts in thousandths of half the diagonal.
  constexpr double kConcavity = 20;
  constexpr double kAny = 1e9;
  Welded mesh = welded(object);
  if (mesh.triangles.empty() || !is_surface(mesh)) return std::nullopt;
  const std::vector<HACD::Vec3<HACD::Real>> points = mesh.points;  // HACD moves them to and fro
  std::optional<std::vector<long>> part_of = parts_of_triangles(mesh, 1, kConcavity);
  const auto count = [&] { return static_cast<std::size_t>(*std::ranges::max_element(*part_of)) + 1; };
  if (part_of && count() > parts_max) {
    mesh.points = points;
    part_of = parts_of_triangles(mesh, parts_max, kAny);
  }
  if (!part_of || count() > parts_max) return std::nullopt;
  std::vector<std::vector<Eigen::Vector3d>> parts(count());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const long corner : {mesh.triangles[t].X(), mesh.triangles[t].Y(), mesh.triangles[t].Z()}) {
      const HACD::Vec3<HACD::Real>& point = points[static_cast<std::size_t>(corner)];
      parts[static_cast<std::size_t>((*part_of)[t])].emplace_back(point.X(), point.Y(), point.Z());
    }
  }
  return parts;
}

}  // namespace tessera
