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

#include "worlds/loader/sdf_parser.h"

namespace tessera {
namespace {

using ignition::math::eigen3::convert;

struct SurfaceOfCollision {
  double friction = 1;  // SDF's default
  double restitution = 0;
  std::uint32_t bitmask = 0xffff;
  std::optional<Surface> own;

  friend bool operator==(const SurfaceOfCollision&, const SurfaceOfCollision&) = default;
};

// Friction of ODE's element, or else of Bullet's, which name the same differently.
void read_friction(const sdf::Collision& collision, SurfaceOfCollision& result, Notices& notices) {
  const sdf::ElementPtr friction = find_element(collision.Element(), {"surface", "friction"});
  const bool is_ode =
      find_element(friction, {"ode", "mu"}) != nullptr || find_element(friction, {"bullet"}) == nullptr;
  const sdf::ElementPtr engine = find_element(friction, {is_ode ? "ode" : "bullet"});
  const char* const second_name = is_ode ? "mu2" : "friction2";
  Surface surface;
  surface.second_friction = 1;  // SDF's default
  find_value(engine, {is_ode ? "mu" : "friction"}, result.friction);
  const bool has_second = find_value(engine, {second_name}, surface.second_friction);
  ignition::math::Vector3d direction;
  if (find_value(engine, {"fdir1"}, direction) && direction != ignition::math::Vector3d::Zero) {
    const Eigen::Vector3d in_link = convert(collision.RawPose().Rot()).normalized() * convert(direction);
    surface.direction = {in_link.x(), in_link.y(), in_link.z()};
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
  if (surface != Surface{}) result.own = surface;
}

SurfaceOfCollision surface_in(const sdf::Collision& collision, Notices& notices) {
  SurfaceOfCollision result;
  const sdf::ElementPtr element = collision.Element();
  read_friction(collision, result, notices);
  find_value(element, {"surface", "bounce", "restitution_coefficient"}, result.restitution);
  // Not through libsdformat's Contact, whose default is 0xff.
  unsigned bitmask = result.bitmask;
  find_value(element, {"surface", "contact", "collide_bitmask"}, bitmask);
  result.bitmask = bitmask;
  return result;
}

}  // namespace

absl::Status keep_surface_motion(xml::Element& link) {
  xml::Element* const motion = link.FirstChildElement(kSurfaceMotion.data());
  if (motion == nullptr) return absl::OkStatus();
  if (motion->NextSiblingElement(kSurfaceMotion.data()) != nullptr)
    return xml::invalid(*motion, "a link has one such element");
  std::string numbers;
  for (const char* name : {"velocity", "running"}) {
    const char* text = motion->Attribute(name);
    const absl::StatusOr<Eigen::Vector3d> vector = xml::vector_in(*motion, text == nullptr ? "0 0 0" : text);
    if (!vector.ok()) return vector.status();
    for (const double x : *vector) absl::StrAppendFormat(&numbers, "%.17g ", x);
    motion->DeleteAttribute(name);
  }
  if (motion->FirstAttribute() != nullptr)
    return xml::invalid(*motion, "unknown attribute '", motion->FirstAttribute()->Name(), "'");
  motion->SetText(numbers.c_str());
  return absl::OkStatus();
}

void read_surface(const sdf::Link& link, BodyProperties& properties, Notices& notices) {
  if (link.CollisionCount() == 0) return;
  const SurfaceOfCollision first = surface_in(*link.CollisionByIndex(0), notices);
  std::uint32_t bits = first.bitmask;
  bool differ = false;
  for (std::uint64_t n = 1; n < link.CollisionCount(); ++n) {
    const SurfaceOfCollision surface = surface_in(*link.CollisionByIndex(n), notices);
    differ = differ || surface != first;
    bits |= surface.bitmask;
  }
  if (differ) notices.count("link whose collisions differ in their surface: the first one is used");
  properties.friction = first.friction;
  properties.restitution = first.restitution;
  properties.surface = first.own;
  // In SDF two collisions meet if their bitmasks have a bit in common.
  properties.category = bits;
  properties.mask = bits;
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
