#include "worlds/loader/surface_reader.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <ignition/math/eigen3/Conversions.hh>
#include <optional>
#include <sdf/Collision.hh>
#include <sdf/Element.hh>
#include <sstream>
#include <string>
#include <vector>

#include "worlds/loader/sdf_parser.h"

namespace tessera {
namespace {

using ignition::math::eigen3::convert;

// SDF's default.
constexpr unsigned kAllBits = 0xffff;

// The frame that the direction of friction is in: an attribute of no schema, as Gazebo reads it.
std::string frame_of_direction(sdf::Element& direction) {
  for (const char* name : {"gz:expressed_in", "ignition:expressed_in"}) {
    if (const sdf::ParamPtr frame = direction.GetAttribute(name)) return frame->GetAsString();
  }
  return "";
}

// The direction of friction in the frame of the link; 0 if there is none.
Eigen::Vector3d direction_of_friction(const sdf::Collision& collision, const sdf::ElementPtr& engine,
                                      const TurnOfFrame& turn_of, Notices& notices) {
  const sdf::ElementPtr element = find_element(engine, {"fdir1"});
  if (element == nullptr) return Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = convert(element->Get<ignition::math::Vector3d>());
  const std::string frame = frame_of_direction(*element);
  if (direction.isZero(0)) return direction;
  if (frame.empty()) return convert(collision.RawPose().Rot()).normalized() * direction;
  if (const std::optional<Eigen::Quaterniond> turn = turn_of(frame)) return *turn * direction;
  notices.count_loss(absl::StrCat("<fdir1> expressed in '", frame,
                                  "', which is no frame on its link: not simulated, friction is alike in all "
                                  "directions"));
  return Eigen::Vector3d::Zero();
}

// Friction of ODE's element, or else of Bullet's, which name the same differently.
void read_friction(const sdf::Collision& collision, const TurnOfFrame& turn_of, PartMaterial& result,
                   Notices& notices) {
  const sdf::ElementPtr friction = find_element(collision.Element(), {"surface", "friction"});
  const bool is_ode =
      find_element(friction, {"ode", "mu"}) != nullptr || find_element(friction, {"bullet"}) == nullptr;
  const sdf::ElementPtr engine = find_element(friction, {is_ode ? "ode" : "bullet"});
  const char* const second_name = is_ode ? "mu2" : "friction2";
  Surface& surface = result.surface;
  surface.second_friction = 1;  // SDF's default
  find_value(engine, {is_ode ? "mu" : "friction"}, result.friction);
  const bool has_second = find_value(engine, {second_name}, surface.second_friction);
  const Eigen::Vector3d direction = direction_of_friction(collision, engine, turn_of, notices);
  if (!direction.isZero(0)) {
    surface.direction = {direction.x(), direction.y(), direction.z()};
  } else {
    if (has_second && surface.second_friction != result.friction) {
      notices.count(absl::StrCat("<", second_name, "> without <fdir1>: friction is alike in all directions"));
    }
    surface.second_friction = 0;
  }
  find_value(find_element(friction, {"bullet"}), {"rolling_friction"}, surface.rolling_friction);
  const sdf::ElementPtr torsional = find_element(friction, {"torsional"});
  find_value(torsional, {"coefficient"}, surface.torsional_friction);
  find_value(torsional, {"patch_radius"}, surface.patch_radius);
  bool is_by_patch = true;
  if (find_value(torsional, {"use_patch_radius"}, is_by_patch); !is_by_patch) {
    notices.count("torsional friction by <surface_radius> not simulated");
    surface.patch_radius = 0;
  }
  if (surface.patch_radius == 0) surface.torsional_friction = 1;  // of no meaning without a patch
}

PartMaterial material_of(const sdf::Collision& collision, const TurnOfFrame& turn_of, Notices& notices) {
  PartMaterial result;
  result.friction = 1;  // SDF's default
  const sdf::ElementPtr element = collision.Element();
  read_friction(collision, turn_of, result, notices);
  find_value(element, {"surface", "bounce", "restitution_coefficient"}, result.restitution);
  // Not through libsdformat's Contact, whose default is 0xff.
  unsigned mask = kAllBits;
  find_value(element, {"surface", "contact", "collide_bitmask"}, mask);
  unsigned category = mask;
  find_value(element, {"surface", "contact", "category_bitmask"}, category);
  result.mask = mask;
  result.category = category;
  result.trigger = is_trigger(collision);
  return result;
}

}  // namespace

absl::Status keep_trigger(xml::Element& element) {
  xml::Element* const trigger = element.FirstChildElement(kTrigger.data());
  if (trigger == nullptr) return absl::OkStatus();
  if (!xml::is(element, "collision")) return xml::invalid(*trigger, "it belongs in a <collision>");
  if (trigger->NextSiblingElement(kTrigger.data()) != nullptr)
    return xml::invalid(*trigger, "a collision has one such element");
  if (trigger->FirstAttribute() != nullptr)
    return xml::invalid(*trigger, "unknown attribute '", trigger->FirstAttribute()->Name(), "'");
  const std::string text = xml::text_of(*trigger);
  const bool says_false = text == "false" || text == "0";
  if (!says_false && !text.empty() && text != "true" && text != "1")
    return xml::invalid(*trigger, "'", text, "' must be true or false");
  trigger->SetText(says_false ? "0" : "1");
  return absl::OkStatus();
}

bool is_trigger(const sdf::Collision& collision) {
  std::string text;
  return find_value(collision.Element(), {kTrigger.data()}, text) && text == "1";
}

absl::Status keep_surface_motion(xml::Element& link) {
  xml::Element* const motion = link.FirstChildElement(kSurfaceMotion.data());
  if (motion == nullptr) return absl::OkStatus();
  if (motion->NextSiblingElement(kSurfaceMotion.data()) != nullptr)
    return xml::invalid(*motion, "a link has one such element");
  std::string numbers;
  for (const char* name : {"velocity", "running"}) {
    const char* text = motion->Attribute(name);
    const absl::StatusOr<Eigen::Vector3d> vector =
        xml::vector_in(*motion, text == nullptr ? "0 0 0" : text, name);
    if (!vector.ok()) return vector.status();
    for (const double x : *vector) absl::StrAppendFormat(&numbers, "%.17g ", x);
    motion->DeleteAttribute(name);
  }
  if (motion->FirstAttribute() != nullptr)
    return xml::invalid(*motion, "unknown attribute '", motion->FirstAttribute()->Name(), "'");
  motion->SetText(numbers.c_str());
  return absl::OkStatus();
}

std::vector<PartMaterial> materials_of(const sdf::Link& link, const TurnOfFrame& turn_of, Notices& notices) {
  std::vector<PartMaterial> result;
  for (std::uint64_t n = 0; n < link.CollisionCount(); ++n)
    result.push_back(material_of(*link.CollisionByIndex(n), turn_of, notices));
  return result;
}

void set_surface(const sdf::Link& link, const std::vector<PartMaterial>& materials,
                 BodyProperties& properties) {
  if (materials.empty()) return;
  const PartMaterial& first = materials.front();
  properties.friction = first.friction;
  properties.restitution = first.restitution;
  if (first.surface != Surface{}) properties.surface = first.surface;
  properties.category = 0;
  properties.mask = 0;
  properties.trigger = true;
  for (const PartMaterial& material : materials) {
    properties.trigger &= material.trigger;
    properties.category |= material.category;
    properties.mask |= material.mask;
  }
  if (std::string text; find_value(link.Element(), {kSurfaceMotion.data()}, text)) {
    std::array<double, 3> velocity{};
    std::array<double, 3> running{};
    std::istringstream numbers(text);
    for (std::array<double, 3>* v : {&velocity, &running}) {
      for (double& x : *v) numbers >> x;
    }
    set_surface_motion(properties, velocity, running);
  }
}

}  // namespace tessera
