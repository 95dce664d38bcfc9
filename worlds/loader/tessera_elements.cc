#include "worlds/loader/tessera_elements.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/model/frame_keys.h"
#include "worlds/loader/geodesy.h"

namespace tessera {
namespace {

using xml::Element;

absl::StatusOr<SectorOffset> sector_in(const Element& element, absl::string_view text) {
  const std::vector<absl::string_view> words =
      absl::StrSplit(text, absl::ByAnyChar(" \t\r\n"), absl::SkipEmpty());
  if (words.size() != 3) return xml::invalid(element, "sector '", text, "' must be 3 integers: i j k");
  SectorOffset result;
  for (const auto& [word, component] :
       {std::pair{words[0], &result.i}, std::pair{words[1], &result.j}, std::pair{words[2], &result.k}}) {
    const absl::StatusOr<std::int64_t> value = xml::integer_in(element, word);
    if (!value.ok()) return xml::invalid(element, "sector '", text, "': ", value.status().message());
    *component = *value;
  }
  return result;
}

// One word of two: false for the first, true for the second.
absl::StatusOr<bool> choice(const Element& element, absl::string_view text, absl::string_view first,
                            absl::string_view second) {
  if (text == first) return false;
  if (text == second) return true;
  return xml::invalid(element, "'", text, "' must be ", first, " or ", second);
}

absl::Status read_setting(const Element& element, WorldSettings& settings) {
  const WorldSetting* setting = find_setting(element.Name());
  if (setting == nullptr && absl::StartsWith(element.Name(), "tessera:"))
    return xml::invalid(element, "no setting: it belongs into the <world>, beside <tessera:settings>");
  if (setting == nullptr) return xml::invalid(element, "unknown setting");
  const absl::Status status = set_from_text(*setting, xml::text_of(element), settings);
  if (!status.ok()) return xml::error_at(element, status.code(), status.message());
  return absl::OkStatus();
}

absl::StatusOr<DriveMode> drive_mode(const Element& drive) {
  const absl::StatusOr<std::string> mode = xml::required_attribute(drive, "mode");
  if (!mode.ok()) return mode.status();
  if (*mode == "free") return DriveMode::kFree;
  if (*mode == "velocity") return DriveMode::kVelocity;
  if (*mode == "position") return DriveMode::kPosition;
  if (*mode == "effort") return DriveMode::kEffort;
  if (*mode == "servo") return DriveMode::kServo;
  return xml::invalid(drive, "mode '", *mode, "' must be free, velocity, position, effort or servo");
}

// 0 or 1.
absl::StatusOr<std::size_t> axis_of(const Element& element) {
  const absl::string_view axis = element.Attribute("axis") == nullptr ? "1" : element.Attribute("axis");
  if (axis != "1" && axis != "2") return xml::invalid(element, "axis '", axis, "' must be 1 or 2");
  return axis == "1" ? 0 : 1;
}

absl::Status read_drive(const Element& drive, JointDrives& drives, std::array<bool, 2>& taken) {
  absl::Status known =
      xml::only_attributes(drive, {"mode", "target", "axis", "stiffness", "damping", "velocity", "effort"});
  if (!known.ok()) return known;
  const absl::StatusOr<DriveMode> mode = drive_mode(drive);
  if (!mode.ok()) return mode.status();
  const absl::StatusOr<std::size_t> axis = axis_of(drive);
  if (!axis.ok()) return axis.status();
  JointDrive result{*mode, 0};
  for (const auto& [name, number] :
       {std::pair{"target", &result.target}, std::pair{"stiffness", &result.stiffness},
        std::pair{"damping", &result.damping}, std::pair{"velocity", &result.velocity},
        std::pair{"effort", &result.effort}}) {
    if (drive.Attribute(name) == nullptr) continue;
    const absl::StatusOr<double> value = xml::number_attribute(drive, name);
    if (!value.ok()) return value.status();
    *number = *value;
  }
  if (taken[*axis]) return xml::invalid(drive, "axis ", *axis + 1, " has a drive already");
  taken[*axis] = true;
  drives[*axis] = result;
  return absl::OkStatus();
}

// An attribute that may be missing.
absl::Status read_vector(const Element& element, const char* name, Eigen::Vector3d& value) {
  const char* text = element.Attribute(name);
  if (text == nullptr) return absl::OkStatus();
  const absl::StatusOr<Eigen::Vector3d> vector = xml::vector_in(element, text, name);
  if (vector.ok()) value = *vector;
  return vector.status();
}

absl::Status read_vector(const Element& element, const char* name, std::optional<Eigen::Vector3d>& value) {
  return element.Attribute(name) == nullptr ? absl::OkStatus() : read_vector(element, name, value.emplace());
}

// A <pose> that is relative to nothing of its own.
absl::StatusOr<Pose> own_pose(const Element& element, const char* what) {
  const absl::StatusOr<xml::RelativePose> pose = xml::pose_of(element);
  if (!pose.ok()) return pose.status();
  if (!pose->relative_to.empty()) return xml::invalid(element, what);
  return pose->pose;
}

absl::Status take_region(Element& element, MovingFrame& frame) {
  Element* region = element.FirstChildElement("tessera:region");
  if (region == nullptr) return absl::OkStatus();
  if (absl::Status status = xml::only_attributes(*region, {"centre", "size"}); !status.ok()) return status;
  const absl::StatusOr<std::string> size = xml::required_attribute(*region, "size");
  if (!size.ok()) return size.status();
  frame.region.emplace();
  if (absl::Status status = read_vector(*region, "size", frame.region->size); !status.ok()) return status;
  if (absl::Status status = read_vector(*region, "centre", frame.region->centre); !status.ok()) return status;
  element.DeleteChild(region);
  return absl::OkStatus();
}

absl::Status take_legs(Element& element, MovingFrame& frame) {
  while (Element* leg = element.FirstChildElement("tessera:leg")) {
    absl::Status status = xml::only_attributes(*leg, {"seconds", "acceleration"});
    if (!status.ok()) return status;
    const absl::StatusOr<double> seconds = xml::number_attribute(*leg, "seconds");
    if (!seconds.ok()) return seconds.status();
    FrameLeg& added = frame.legs.emplace_back(FrameLeg{*seconds});
    if (status = read_vector(*leg, "acceleration", added.acceleration); !status.ok()) return status;
    element.DeleteChild(leg);
  }
  return absl::OkStatus();
}

absl::Status take_keys(Element& element, MovingFrame& frame) {
  while (Element* key = element.FirstChildElement("tessera:key")) {
    absl::Status status = xml::only_attributes(*key, {"time", "velocity", "spin"});
    if (!status.ok()) return status;
    const absl::StatusOr<double> time = xml::number_attribute(*key, "time");
    if (!time.ok()) return time.status();
    FrameKey& added = frame.keys.emplace_back();
    added.time = *time;
    if (status = read_vector(*key, "velocity", added.velocity); !status.ok()) return status;
    if (status = read_vector(*key, "spin", added.spin); !status.ok()) return status;
    for (const Element* child = key->FirstChildElement(); child != nullptr;
         child = child->NextSiblingElement()) {
      if (!xml::is(*child, "pose") || child->NextSiblingElement() != nullptr)
        return xml::invalid(*child, "a <tessera:key> has one <pose>, and nothing else");
      const absl::StatusOr<Pose> pose = own_pose(*child, "a key is relative to where its frame starts");
      if (!pose.ok()) return pose.status();
      added.pose = *pose;
    }
    element.DeleteChild(key);
  }
  if (frame.keys.size() <= kFrameKeysMax) smooth_keys(frame.keys, frame.loops);
  return absl::OkStatus();
}

}  // namespace

absl::Status read_settings(const Element& element, WorldSettings& settings) {
  if (absl::Status status = xml::only_attributes(element, {}); !status.ok()) return status;
  for (const Element* child = element.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (absl::Status status = read_setting(*child, settings); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<CentralGravity> read_central_gravity(const Element& element, double sector_size) {
  if (absl::Status status = xml::only_attributes(element, {"surface", "radius", "sector", "local"});
      !status.ok()) {
    return status;
  }
  CentralGravity result;
  for (const auto& [name, value] :
       {std::pair{"surface", &result.surface}, std::pair{"radius", &result.radius}}) {
    const absl::StatusOr<double> number = xml::number_attribute(element, name);
    if (!number.ok()) return number.status();
    *value = *number;
  }
  SectorIndex sector;
  if (const char* text = element.Attribute("sector")) {
    const absl::StatusOr<SectorOffset> offset = sector_in(element, text);
    if (!offset.ok()) return offset.status();
    sector = {offset->i, offset->j, offset->k};
  }
  Eigen::Vector3d local = Eigen::Vector3d::Zero();
  if (const char* text = element.Attribute("local")) {
    const absl::StatusOr<Eigen::Vector3d> vector = xml::vector_in(element, text, "local");
    if (!vector.ok()) return vector.status();
    local = *vector;
  }
  const absl::StatusOr<WorldPosition> centre = canonical(sector, local, sector_size);
  if (!centre.ok()) return xml::error_at(element, centre.status().code(), centre.status().message());
  result.centre = *centre;
  return result;
}

absl::StatusOr<WorldPose> read_site(const Element& element, double sector_size) {
  absl::Status status = xml::only_attributes(element, {"name", "latitude", "longitude", "height", "frame"});
  if (!status.ok()) return status;
  const absl::StatusOr<double> latitude = xml::number_attribute(element, "latitude");
  if (!latitude.ok()) return latitude.status();
  const absl::StatusOr<double> longitude = xml::number_attribute(element, "longitude");
  if (!longitude.ok()) return longitude.status();
  double height = 0;
  if (element.Attribute("height") != nullptr) {
    const absl::StatusOr<double> value = xml::number_attribute(element, "height");
    if (!value.ok()) return value.status();
    height = *value;
  }
  SiteUp up = SiteUp::kGeodetic;
  if (const char* text = element.Attribute("frame")) {
    const absl::StatusOr<bool> geocentric = choice(element, text, "geodetic", "geocentric");
    if (!geocentric.ok()) return geocentric.status();
    up = *geocentric ? SiteUp::kGeocentric : SiteUp::kGeodetic;
  }
  absl::StatusOr<WorldPose> frame = site_frame(*latitude, *longitude, height, up, sector_size);
  if (!frame.ok()) return xml::error_at(element, frame.status().code(), frame.status().message());
  return frame;
}

absl::StatusOr<MovingFrame> take_moving_frame(Element& element, FrameNumber parent, double sector_size) {
  MovingFrame result;
  const absl::StatusOr<PlacementExtras> extras = take_extras(element);
  if (!extras.ok()) return extras.status();
  if (absl::Status status =
          xml::only_attributes(element, {"name", "velocity", "spin", "falls", "loops", "carrier"});
      !status.ok())
    return status;
  const absl::StatusOr<std::string> name = xml::required_attribute(element, "name");
  if (!name.ok()) return name.status();
  result.name = *name;
  for (const auto& [attribute, value] :
       {std::pair{"velocity", &result.velocity}, std::pair{"spin", &result.spin}}) {
    if (absl::Status status = read_vector(element, attribute, *value); !status.ok()) return status;
  }
  for (const auto& [attribute, value] :
       {std::pair{"falls", &result.falls}, std::pair{"loops", &result.loops}}) {
    const char* text = element.Attribute(attribute);
    if (text == nullptr) continue;
    const absl::StatusOr<bool> chosen = choice(element, text, "false", "true");
    if (!chosen.ok()) return chosen.status();
    *value = *chosen;
  }
  Pose pose;
  if (Element* child = element.FirstChildElement("pose")) {
    const absl::StatusOr<Pose> start =
        own_pose(*child, "a <tessera:frame> starts relative to the world, or to the one around it");
    if (!start.ok()) return start.status();
    pose = *start;
    element.DeleteChild(child);
  }
  if (element.Attribute("carrier")) {
    for (const char* attribute : {"velocity", "spin"}) {
      if (element.Attribute(attribute))
        return xml::invalid(element, "with a 'carrier', whose velocities it has, there is no '", attribute,
                            "'");
    }
    result.carrier = FrameCarrier{{}, pose};
  }
  const WorldPose sector{{{extras->sector.i, extras->sector.j, extras->sector.k, parent}}};
  const absl::StatusOr<WorldPose> start = compose(sector, pose, sector_size);
  if (!start.ok()) return xml::error_at(element, start.status().code(), start.status().message());
  result.start = *start;
  for (const auto take : {take_region, take_legs, take_keys}) {
    if (absl::Status status = take(element, result); !status.ok()) return status;
  }
  return result;
}

absl::StatusOr<PlacementExtras> take_extras(Element& element) {
  PlacementExtras result;
  const auto take_sector = [&](const Element& place, absl::string_view text) {
    const absl::StatusOr<SectorOffset> sector = sector_in(place, text);
    if (sector.ok()) result.sector = *sector;
    return sector.status();
  };
  if (const char* text = element.Attribute("tessera:sector")) {
    if (absl::Status status = take_sector(element, text); !status.ok()) return status;
    element.DeleteAttribute("tessera:sector");
  }
  if (Element* child = element.FirstChildElement("tessera:sector")) {
    if (absl::Status status = xml::only_attributes(*child, {}); !status.ok()) return status;
    if (absl::Status status = take_sector(*child, xml::text_of(*child)); !status.ok()) return status;
    element.DeleteChild(child);
  }
  if (Element* child = element.FirstChildElement("tessera:velocity")) {
    if (absl::Status status = xml::only_attributes(*child, {"linear", "angular"}); !status.ok())
      return status;
    for (const auto& [name, value] :
         {std::pair{"linear", &result.linear_velocity}, std::pair{"angular", &result.angular_velocity}}) {
      const char* text = child->Attribute(name);
      if (text == nullptr) continue;
      const absl::StatusOr<Eigen::Vector3d> vector = xml::vector_in(*child, text, name);
      if (!vector.ok()) return vector.status();
      *value = *vector;
    }
    element.DeleteChild(child);
  }
  return result;
}

absl::StatusOr<JointDrives> take_drives(Element& joint) {
  JointDrives result;
  std::array<bool, 2> taken{};
  while (Element* drive = joint.FirstChildElement("tessera:drive")) {
    if (absl::Status status = read_drive(*drive, result, taken); !status.ok()) return status;
    joint.DeleteChild(drive);
  }
  return result;
}

absl::StatusOr<std::array<double, 2>> take_armatures(Element& joint) {
  std::array<double, 2> result{};
  std::array<bool, 2> taken{};
  while (Element* armature = joint.FirstChildElement("tessera:armature")) {
    if (absl::Status status = xml::only_attributes(*armature, {"value", "axis"}); !status.ok()) return status;
    const absl::StatusOr<std::size_t> axis = axis_of(*armature);
    if (!axis.ok()) return axis.status();
    const absl::StatusOr<double> value = xml::number_attribute(*armature, "value");
    if (!value.ok()) return value.status();
    if (taken[*axis]) return xml::invalid(*armature, "axis ", *axis + 1, " has an armature already");
    taken[*axis] = true;
    result[*axis] = *value;
    joint.DeleteChild(armature);
  }
  return result;
}

}  // namespace tessera
