#include "worlds/loader/given_geometry.h"

#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "tiles/height_image.h"
#include "tiles/tile_folder.h"
#include "worlds/loader/file_search.h"

namespace tessera {
namespace {

using xml::Element;

constexpr std::array<absl::string_view, 5> kGiven = {"tessera:heightfield", "tessera:ground", "heightmap",
                                                     "polyline", "cone"};
constexpr int kConeSides = 32;
constexpr std::size_t kPartsDefault = 16;

absl::StatusOr<std::vector<double>> numbers_of(const Element& element, std::size_t count) {
  absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(element, xml::text_of(element));
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() != count)
    return xml::invalid(element, "'", xml::text_of(element), "' must be ", count, " numbers");
  return numbers;
}

absl::StatusOr<double> length_of(const Element& parent, const char* name) {
  const Element* element = parent.FirstChildElement(name);
  if (element == nullptr) return xml::invalid(parent, "the <", name, "> is missing");
  const absl::StatusOr<double> value = xml::number_of(*element);
  if (!value.ok()) return value.status();
  if (*value < kExtentMin || *value > kStaticExtentMax) {
    return xml::invalid(*element, *value, " m must be ", kExtentMin, " m to ", kStaticExtentMax, " m");
  }
  return *value;
}

// <tessera:heightfield columns= rows= spacing="x y">heights, row by row</tessera:heightfield>
absl::StatusOr<GivenGeometry> height_field(const Element& element) {
  HeightField field;
  for (const auto& [name, count] : {std::pair{"columns", &field.columns}, std::pair{"rows", &field.rows}}) {
    const absl::StatusOr<double> value = xml::number_attribute(element, name);
    if (!value.ok()) return value.status();
    if (*value < 2 || *value > static_cast<double>(kHeightFieldSamplesMax)) {
      return xml::invalid(element, name, " = ", *value, " must be 2 to ", kHeightFieldSamplesMax);
    }
    *count = static_cast<std::uint32_t>(*value);
  }
  const absl::StatusOr<std::string> text = xml::required_attribute(element, "spacing");
  if (!text.ok()) return text.status();
  const absl::StatusOr<std::vector<double>> spacing = xml::numbers_in(element, *text);
  if (!spacing.ok()) return spacing.status();
  if (spacing->size() != 2) return xml::invalid(element, "spacing = '", *text, "' must be 2 numbers: x y");
  field.spacing = {(*spacing)[0], (*spacing)[1]};
  absl::StatusOr<std::vector<double>> heights = xml::numbers_in(element, xml::text_of(element));
  if (!heights.ok()) return heights.status();
  const std::uint64_t samples = std::uint64_t{field.columns} * field.rows;
  if (heights->size() != samples) {
    return xml::invalid(element, heights->size(), " heights must be ", field.columns, " x ", field.rows,
                        " = ", samples);
  }
  field.heights = *std::move(heights);
  return PlacedHeightField{std::move(field)};
}

// A number of an attribute that may be missing.
absl::Status optional_number(const Element& element, const char* name, double& value) {
  if (element.Attribute(name) == nullptr) return absl::OkStatus();
  const absl::StatusOr<double> number = xml::number_attribute(element, name);
  if (number.ok()) value = *number;
  return number.status();
}

// <tessera:ground source="folder" folder= [edge=] [low=] [high=]/>
absl::StatusOr<GivenGeometry> ground_of_folder(const Element& element,
                                               const std::filesystem::path& directory) {
  absl::Status status = xml::only_attributes(element, {"source", "folder", "edge", "low", "high"});
  if (!status.ok()) return status;
  const absl::StatusOr<std::string> path = xml::required_attribute(element, "folder");
  if (!path.ok()) return path.status();
  Ground ground;
  ground.source = Ground::Source::kFolder;
  // Servers open it by this name.
  ground.folder = std::filesystem::absolute(directory / *path).lexically_normal().string();
  for (const auto& [name, value] :
       {std::pair{"edge", &ground.edge}, std::pair{"low", &ground.low}, std::pair{"high", &ground.height}}) {
    if (status = optional_number(element, name, *value); !status.ok()) return status;
  }
  if (!(ground.edge >= 0 && ground.edge <= kStaticExtentMax))
    return xml::invalid(element, "edge = ", ground.edge, " m must be 0 m to ", kStaticExtentMax, " m");
  use_tile_folders();
  absl::StatusOr<Ground> described = described_folder(std::move(ground));
  if (!described.ok()) return xml::error_at(element, described.status().code(), described.status().message());
  return *std::move(described);
}

// <tessera:ground source="plain" spacing= height= wavelength= [octaves=] [seed=] [sea=]/>
// <tessera:ground source="planet" radius= .../>
absl::StatusOr<GivenGeometry> ground(const Element& element, const std::filesystem::path& directory) {
  const absl::StatusOr<std::string> source = xml::required_attribute(element, "source");
  if (!source.ok()) return source.status();
  if (*source == "folder") return ground_of_folder(element, directory);
  if (*source != "plain" && *source != "planet")
    return xml::invalid(element, "source '", *source, "' must be plain, planet or folder");
  absl::Status status = xml::only_attributes(
      element, {"source", "spacing", "radius", "height", "wavelength", "octaves", "seed", "sea"});
  if (!status.ok()) return status;
  Ground ground;
  const bool is_planet = *source == "planet";
  ground.source = is_planet ? Ground::Source::kPlanet : Ground::Source::kPlain;
  if (!is_planet && element.Attribute("radius") != nullptr)
    return xml::invalid(element, "a plain has no radius");
  for (const auto& [name, value] :
       {std::pair{"spacing", &ground.spacing}, std::pair{"radius", &ground.radius},
        std::pair{"height", &ground.height}, std::pair{"wavelength", &ground.wavelength}}) {
    if (!is_planet && value == &ground.radius) continue;
    const absl::StatusOr<double> number = xml::number_attribute(element, name);
    if (!number.ok()) return number.status();
    *value = *number;
  }
  std::int64_t octaves = 1;
  std::int64_t seed = 0;
  for (const auto& [name, value] : {std::pair{"octaves", &octaves}, std::pair{"seed", &seed}}) {
    const char* text = element.Attribute(name);
    if (text == nullptr) continue;
    const absl::StatusOr<std::int64_t> number = xml::integer_in(element, text);
    if (!number.ok()) return number.status();
    *value = *number;
  }
  if (octaves < 1 || octaves > std::int64_t{kGroundOctavesMax})
    return xml::invalid(element, "octaves = ", octaves, " must be 1 to ", kGroundOctavesMax);
  ground.octaves = static_cast<std::uint32_t>(octaves);
  ground.seed = static_cast<std::uint64_t>(seed);
  if (const char* sea = element.Attribute("sea")) {
    const absl::string_view given(sea);
    if (given != "true" && given != "false")
      return xml::invalid(element, "sea '", given, "' must be true or false");
    ground.has_sea = given == "true";
  }
  return ground;
}

// The image from above, with x to the right and y upwards; white is as high as the size says.
absl::StatusOr<GivenGeometry> height_map(const Element& element, const std::filesystem::path& directory,
                                         Notices& notices) {
  const Element* uri = element.FirstChildElement("uri");
  if (uri == nullptr) return xml::invalid(element, "the <uri> is missing");
  const absl::StatusOr<std::filesystem::path> file = find_uri(xml::text_of(*uri), directory);
  if (absl::IsNotFound(file.status())) {
    notices.count_missing_file(xml::text_of(*uri), xml::place_of(*uri), file.status().message());
    return stand_in();
  }
  if (!file.ok()) return xml::error_at(*uri, file.status().code(), file.status().message());
  Eigen::Vector3d size(1, 1, 1);
  PlacedHeightField result;
  for (const auto& [name, vector] : {std::pair{"size", &size}, std::pair{"pos", &result.position}}) {
    const Element* child = element.FirstChildElement(name);
    if (child == nullptr) continue;
    const absl::StatusOr<std::vector<double>> numbers = numbers_of(*child, 3);
    if (!numbers.ok()) return numbers.status();
    *vector = Eigen::Vector3d(numbers->data());
    if (vector->cwiseAbs().maxCoeff() > kStaticExtentMax)
      return xml::invalid(*child, "each must be at most ", kStaticExtentMax, " m");
  }
  if (size.head<2>().minCoeff() < kExtentMin || size.z() < 0)
    return xml::invalid(element, "the size must be at least ", kExtentMin, " m in x and y, and 0 in z");
  absl::StatusOr<HeightImage> image = read_height_image(*file);
  if (!image.ok()) return xml::error_at(*uri, image.status().code(), image.status().message());
  HeightField& field = result.field;
  field.columns = image->columns;
  field.rows = image->rows;
  field.spacing = {size.x() / (field.columns - 1), size.y() / (field.rows - 1)};
  field.heights.reserve(image->heights.size());
  for (std::size_t row = field.rows; row-- > 0;) {
    for (std::size_t column = 0; column < field.columns; ++column)
      field.heights.push_back(image->heights[row * field.columns + column] * size.z());
  }
  return result;
}

bool surrounds(const Outline& outline, const Eigen::Vector2d& point) {
  bool is_inside = false;
  for (std::size_t n = 0; n < outline.size(); ++n) {
    const Eigen::Vector2d& a = outline[n];
    const Eigen::Vector2d& b = outline[(n + 1) % outline.size()];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) is_inside = !is_inside;
  }
  return is_inside;
}

absl::StatusOr<Prism> prism_of(const Element& element) {
  Prism prism;
  for (const Element* point = element.FirstChildElement("point"); point != nullptr;
       point = point->NextSiblingElement("point")) {
    const absl::StatusOr<std::vector<double>> numbers = numbers_of(*point, 2);
    if (!numbers.ok()) return numbers.status();
    const Eigen::Vector2d at(numbers->data());
    if (at.cwiseAbs().maxCoeff() > kStaticExtentMax)
      return xml::invalid(*point, "each must be at most ", kStaticExtentMax, " m");
    if (prism.outline.empty() || prism.outline.back() != at) prism.outline.push_back(at);
  }
  while (prism.outline.size() > 1 && prism.outline.front() == prism.outline.back()) prism.outline.pop_back();
  if (prism.outline.size() < 3) return xml::invalid(element, "there must be 3 different points or more");
  const double area = double_area(prism.outline) / 2;
  if (std::abs(area) < kExtentMin * kExtentMin)
    return xml::invalid(element, "the area must be at least ", kExtentMin * kExtentMin, " m^2");
  if (area < 0) std::ranges::reverse(prism.outline);
  const absl::StatusOr<double> height = length_of(element, "height");
  if (!height.ok()) return height.status();
  prism.height = *height;
  return prism;
}

absl::StatusOr<GivenGeometry> prisms(const Element& first, Notices& notices) {
  Prisms all;
  std::size_t points = 0;
  for (const Element* element = &first; element != nullptr;
       element = element->NextSiblingElement("polyline")) {
    absl::StatusOr<Prism> prism = prism_of(*element);
    if (!prism.ok()) return prism.status();
    points += prism->outline.size();
    if (points > kOutlinePointsMax)
      return xml::invalid(*element, "all points together must be at most ", kOutlinePointsMax);
    if (absl::Status status = triangles_of(prism->outline).status(); !status.ok())
      return xml::invalid(*element, status.message());
    const bool is_hole = std::ranges::any_of(
        all, [&](const Prism& other) { return surrounds(other.outline, prism->outline.front()); });
    if (is_hole) {
      notices.count("<polyline> inside another, a hole, filled");
    } else {
      all.push_back(*std::move(prism));
    }
  }
  return all;
}

// Its tip is at z = length / 2.
absl::StatusOr<GivenGeometry> cone(const Element& element) {
  const absl::StatusOr<double> radius = length_of(element, "radius");
  if (!radius.ok()) return radius.status();
  const absl::StatusOr<double> length = length_of(element, "length");
  if (!length.ok()) return length.status();
  Cone result;
  ConvexHull& hull = result.hull;
  hull.points.emplace_back(0, 0, *length / 2);
  for (int n = 0; n < kConeSides; ++n) {
    const portable::SinCos around = portable::sincos(2 * std::numbers::pi * n / kConeSides);
    hull.points.emplace_back(*radius * around.cos, *radius * around.sin, -*length / 2);
  }
  return result;
}

}  // namespace

bool is_given(const Element& kind) { return std::ranges::find(kGiven, kind.Name()) != kGiven.end(); }

absl::StatusOr<GivenGeometry> given_geometry(const Element& kind, const std::filesystem::path& directory,
                                             Notices& notices) {
  if (xml::is(kind, "heightmap")) return height_map(kind, directory, notices);
  if (xml::is(kind, "polyline")) return prisms(kind, notices);
  if (xml::is(kind, "cone")) return cone(kind);
  if (xml::is(kind, "tessera:ground")) return ground(kind, directory);
  return height_field(kind);
}

GivenGeometry stand_in() { return Cone{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}; }

absl::StatusOr<std::size_t> take_optimization(Element& mesh, Notices& notices) {
  const char* given = mesh.Attribute("optimization");
  const std::string optimization = given == nullptr ? "" : given;
  Element* const decomposition = mesh.FirstChildElement("convex_decomposition");
  std::size_t parts = 0;
  if (optimization == "convex_decomposition") {
    parts = kPartsDefault;
    const Element* most = decomposition ? decomposition->FirstChildElement("max_convex_hulls") : nullptr;
    if (most != nullptr) {
      const absl::StatusOr<std::int64_t> number = xml::integer_in(*most, xml::text_of(*most));
      if (!number.ok()) return number.status();
      if (*number < 1 || *number > static_cast<std::int64_t>(kPartsMax))
        return xml::invalid(*most, *number, " must be 1 to ", kPartsMax);
      parts = static_cast<std::size_t>(*number);
    }
  } else if (!optimization.empty() && optimization != "convex_hull") {
    notices.count_repair("unknown optimization of a <mesh>, left out", xml::place_of(mesh));
  }
  mesh.DeleteAttribute("optimization");
  if (decomposition != nullptr) mesh.DeleteChild(decomposition);
  return parts;
}

ConvexHull prism_hull(const Outline& outline, double height) {
  ConvexHull hull;
  for (const double z : {0.0, height}) {
    for (const Eigen::Vector2d& point : outline) hull.points.emplace_back(point.x(), point.y(), z);
  }
  return hull;
}

absl::StatusOr<TriangleMesh> prism_surface(const Prism& prism) {
  const absl::StatusOr<std::vector<std::uint32_t>> triangles = triangles_of(prism.outline);
  if (!triangles.ok()) return triangles.status();
  TriangleMesh mesh{prism_hull(prism.outline, prism.height).points, {}};
  const auto size = static_cast<std::uint32_t>(prism.outline.size());
  for (std::size_t n = 0; n < triangles->size(); n += 3) {
    const std::uint32_t* const t = &(*triangles)[n];
    mesh.indices.insert(mesh.indices.end(), {t[0], t[2], t[1], size + t[0], size + t[1], size + t[2]});
  }
  for (std::uint32_t n = 0; n < size; ++n) {
    const std::uint32_t next = (n + 1) % size;
    mesh.indices.insert(mesh.indices.end(), {n, next, size + next, n, size + next, size + n});
  }
  return mesh;
}

absl::StatusOr<std::vector<TriangleMesh>> surfaces_of(const GivenGeometry& given) {
  std::vector<TriangleMesh> result;
  if (const auto* prisms = std::get_if<Prisms>(&given)) {
    for (const Prism& prism : *prisms) {
      absl::StatusOr<TriangleMesh> surface = prism_surface(prism);
      if (!surface.ok()) return surface.status();
      result.push_back(*std::move(surface));
    }
  } else if (const auto* cone = std::get_if<Cone>(&given)) {
    TriangleMesh& mesh = result.emplace_back(TriangleMesh{cone->hull.points, {}});
    const auto sides = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    for (std::uint32_t n = 1; n <= sides; ++n) {
      const std::uint32_t next = n % sides + 1;
      mesh.indices.insert(mesh.indices.end(), {0, n, next, 1, next, n});
    }
  }
  return result;
}

}  // namespace tessera
