#include "viewer/json.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "lpss/model/moving_frame.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;

json quaternion(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

json coordinates(const std::vector<Eigen::Vector3d>& points) {
  json flat = json::array();
  for (const Eigen::Vector3d& point : points) {
    for (const double coordinate : point) flat.push_back(coordinate);
  }
  return flat;
}

json kind_of(const Box& box) { return {{"kind", "box"}, {"size", to_json(box.size)}}; }
json kind_of(const Sphere& sphere) { return {{"kind", "sphere"}, {"radius", sphere.radius}}; }
json kind_of(const Capsule& capsule) {
  return {{"kind", "capsule"}, {"radius", capsule.radius}, {"length", capsule.length}};
}
json kind_of(const Cylinder& cylinder) {
  return {{"kind", "cylinder"}, {"radius", cylinder.radius}, {"length", cylinder.length}};
}
json kind_of(const Ellipsoid& ellipsoid) {
  return {{"kind", "ellipsoid"}, {"radii", to_json(ellipsoid.radii)}};
}
json kind_of(const Plane& plane) { return {{"kind", "plane"}, {"normal", to_json(plane.normal)}}; }
json kind_of(const ConvexHull& hull) { return {{"kind", "hull"}, {"points", coordinates(hull.points)}}; }
json kind_of(const TriangleMesh& mesh) {
  return {{"kind", "mesh"}, {"vertices", coordinates(mesh.vertices)}, {"indices", mesh.indices}};
}
json kind_of(const HeightField& field) {
  return {{"kind", "heights"},
          {"columns", field.columns},
          {"rows", field.rows},
          {"spacing", {field.spacing.x(), field.spacing.y()}},
          {"heights", field.heights}};
}
// The page does not show it: it has no end.
json kind_of(const Ground&) { return {{"kind", "ground"}}; }

}  // namespace

json to_json(const SectorIndex& sector) {
  return {absl::StrCat(sector.i), absl::StrCat(sector.j), absl::StrCat(sector.k)};
}

json to_json(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

json to_json(const WorldPosition& position) {
  json told = {{"sector", to_json(position.sector)}, {"local", to_json(position.local)}};
  if (position.sector.frame != kWorldFrame) told["frame"] = position.sector.frame;
  return told;
}

json to_json(const Shape& shape) {
  json parts = json::array();
  const auto is_trigger = [](const ShapePart& part) { return part.material && part.material->trigger; };
  const bool are_all_triggers = std::ranges::all_of(shape.parts, is_trigger);
  for (const ShapePart& part : shape.parts) {
    if (is_trigger(part) && !are_all_triggers) continue;  // it would hide the others
    json entry = std::visit([](const auto& geometry) { return kind_of(geometry); }, part.geometry);
    entry["position"] = to_json(part.pose.position);
    entry["orientation"] = quaternion(part.pose.orientation);
    if (is_trigger(part)) entry["trigger"] = true;
    parts.push_back(std::move(entry));
  }
  return parts;
}

// Of meshes, as many digits as can be seen.
json to_json(const Look& look) {
  constexpr double kPerMetre = 1e5;
  json parts = to_json(look.shape);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    parts[n]["colour"] = look.colours[n];
    if (!parts[n].contains("vertices")) continue;
    for (json& number : parts[n]["vertices"])
      number = std::round(number.get<double>() * kPerMetre) / kPerMetre;
  }
  return parts;
}

json to_json(const FoundBody& body) {
  const BodyProperties& properties = body.properties;
  return {{"id", body.id.value},
          {"name", body.name},
          {"shape", properties.shape},
          {"motion", name_of(properties.motion)},
          {"trigger", properties.trigger},
          {"mass", properties.mass},
          {"centre", properties.centre},
          {"friction", properties.friction},
          {"restitution", properties.restitution}};
}

absl::StatusOr<Eigen::Vector3d> vector_from(const json& given) {
  if (!given.is_array() || given.size() != 3) return absl::InvalidArgumentError("expected three numbers");
  Eigen::Vector3d vector;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!given[axis].is_number()) return absl::InvalidArgumentError("expected three numbers");
    vector[static_cast<Eigen::Index>(axis)] = given[axis].get<double>();
  }
  return vector;
}

// The library converts fractions, and numbers beyond 64 bits, which is undefined.
absl::StatusOr<std::uint64_t> natural_from(const json& given) {
  if (!given.is_number_unsigned() && !(given.is_number_integer() && given.get<std::int64_t>() >= 0))
    return absl::InvalidArgumentError("expected a whole number from 0 to 2^64 - 1");
  return given.get<std::uint64_t>();
}

absl::StatusOr<FrameNumber> frame_from(const json& given) {
  const auto frame = given.find("frame");
  if (frame == given.end()) return kWorldFrame;
  const absl::StatusOr<std::uint64_t> number = natural_from(*frame);
  if (!number.ok()) return absl::InvalidArgumentError(absl::StrCat("frame: ", number.status().message()));
  if (*number > kMovingFramesMax)
    return absl::InvalidArgumentError(absl::StrCat("frame: ", *number, " is not 0 to ", kMovingFramesMax));
  return static_cast<FrameNumber>(*number);
}

absl::StatusOr<WorldPosition> position_from(const json& given) {
  const absl::Status no_sector =
      absl::InvalidArgumentError("sector: expected three 64-bit integers as strings");
  const auto sector = given.find("sector");
  const auto local = given.find("local");
  if (sector == given.end() || !sector->is_array() || sector->size() != 3) return no_sector;
  std::array<std::int64_t, 3> index{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const json& component = (*sector)[axis];
    if (!component.is_string() || !absl::SimpleAtoi(component.get_ref<const std::string&>(), &index[axis])) {
      return no_sector;
    }
  }
  const absl::StatusOr<Eigen::Vector3d> displacement = vector_from(local == given.end() ? json() : *local);
  if (!displacement.ok()) return displacement.status();
  const absl::StatusOr<FrameNumber> frame = frame_from(given);
  if (!frame.ok()) return frame.status();
  return WorldPosition{{index[0], index[1], index[2], *frame}, *displacement};
}

json message_from(std::string_view text) {
  bool is_too_deep = false;
  const json message = json::parse(
      text.begin(), text.end(),
      [&](int depth, json::parse_event_t, json&) {
        is_too_deep = is_too_deep || depth > kNestingMax;
        return !is_too_deep;
      },
      /*allow_exceptions=*/false);
  return is_too_deep ? json(json::value_t::discarded) : message;
}

std::string dump(const json& given) { return given.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace tessera::viewer
