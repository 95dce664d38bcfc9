#include "lpss/native/combine.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace tessera::native {
namespace {

// One of two that touch, in the world's axes.
struct Side {
  Side(const Body& body, const Part* part)
      : friction(body.friction), restitution(body.restitution), second(body.friction) {
    const Material* const material = part == nullptr ? nullptr : part->material.get();
    if (material) {
      friction = second = material->friction;
      restitution = material->restitution;
    }
    if (body.surface) {
      const auto in_world = [&](const Vector& v) -> Vector {
        return body.motion == Motion::kStatic ? v : Vector(body.pose.rotation * v);
      };
      has_surface = true;
      velocity = in_world(body.surface->velocity);
      running = in_world(body.surface->running);
      if (!material) take(*body.surface, in_world);
    }
    if (material && material->surface) {
      has_surface = true;
      take(*material->surface, [&](const Vector& v) -> Vector {
        return body.pose.rotation * (part->is_placed ? Vector(part->frame.rotation * v) : v);
      });
    }
  }

  template <typename InWorld>
  void take(const BodySurface& own, const InWorld& in_world) {
    torsional = own.torsional_friction;
    radius = own.patch_radius;
    rolling = own.rolling_friction;
    if (own.direction.isZero(0)) return;
    direction = in_world(own.direction);
    second = own.second_friction;
  }

  Scalar friction;
  Scalar restitution;
  bool has_surface = false;
  Vector direction = Vector::Zero();
  Scalar second;  // friction across the direction
  Scalar torsional = 1;
  Scalar radius = 0;
  Scalar rolling = 0;
  Vector velocity = Vector::Zero();
  Vector running = Vector::Zero();
};

// Part `n` of a body, if it has a material of its own: nullptr also for patches of sweeps, which have no
// parts.
const Part* part_with_material(const Body& body, std::uint32_t n) {
  if (!body.solid->has_materials() || n >= body.solid->parts().size()) return nullptr;
  const Part& part = body.solid->parts()[n];
  return part.material ? &part : nullptr;
}

}  // namespace

// Friction is the smaller one of the two, as in Gazebo. What slides at an angle to the direction of friction
// is held within an ellipse, whose axes are the smaller coefficients of both.
ContactMaterial combined(const Body& a, const Part* p, const Body& b, const Part* q) {
  constexpr Scalar kShareMin = Scalar(1e-4);  // less is none
  const Side of_a(a, p);
  const Side of_b(b, q);
  const Scalar first = std::min(of_a.friction, of_b.friction);
  ContactMaterial result{first, of_a.restitution * of_b.restitution, std::nullopt};
  if (!of_a.has_surface && !of_b.has_surface) return result;
  ContactSurface surface;
  const Scalar second = std::min(of_a.second, of_b.second);
  surface.direction = of_a.direction.isZero(0) ? of_b.direction : of_a.direction;
  surface.rolling = std::max(of_a.rolling, of_b.rolling);
  surface.velocity = of_a.velocity - of_b.velocity;
  surface.running = of_a.running + of_b.running;
  surface.torsion = Scalar(3 * std::numbers::pi / 16) * std::min(of_a.torsional, of_b.torsional) *
                    std::max(of_a.radius, of_b.radius);
  result.friction = std::max(first, second);
  const auto share = [&](Scalar coefficient) {
    const Scalar is = result.friction > 0 ? coefficient / result.friction : 1;
    return is >= kShareMin ? is : 0;
  };
  surface.along = share(first);
  surface.across = share(second);
  result.surface = surface;
  return result;
}

bool may_touch(const Body& a, const Part& p, const Body& b, const Part& q) {
  const auto bits = [](const Body& body, const Part& part) {
    return part.material ? std::pair(part.material->category, part.material->mask)
                         : std::pair(body.category, body.mask);
  };
  const auto [category_a, mask_a] = bits(a, p);
  const auto [category_b, mask_b] = bits(b, q);
  return (category_a & mask_b) != 0 && (category_b & mask_a) != 0;
}

// Patches that a contact has brought from another sector may have other numbers for the parts of a static
// body, of which each sector has as much as it needs. So they keep their materials as long as they are not
// found anew; and what turns with the bodies is found anew in each tick.
void update_materials(const Body& a, const Body& b, bool is_new, Contact& contact) {
  if (!is_new && contact.materials && contact.materials->size() == contact.patches.size()) return;
  std::vector<ContactMaterial> found;
  for (const ContactPatch& patch : contact.patches) {
    found.push_back(combined(a, part_with_material(a, static_cast<std::uint32_t>(patch.parts >> 32)), b,
                             part_with_material(b, static_cast<std::uint32_t>(patch.parts))));
  }
  // What bounces anywhere is treated so.
  contact.restitution = found.empty() ? a.restitution * b.restitution : 0;
  for (const ContactMaterial& material : found)
    contact.restitution = std::max(contact.restitution, material.restitution);
  if (!contact.materials || *contact.materials != found)
    contact.materials = std::make_shared<const std::vector<ContactMaterial>>(std::move(found));
  const auto turns = [](const ContactMaterial& material) {
    return material.surface && (!material.surface->direction.isZero(0) || material.surface->moves());
  };
  if (!a.surface && !b.surface && std::ranges::none_of(*contact.materials, turns)) return;
  contact.is_found = false;
  contact.found_at = {};
}

void add_predicted_material(const ContactMaterial& material, Contact& contact) {
  std::vector<ContactMaterial> materials;
  if (contact.materials) materials = *contact.materials;
  if (materials.size() + 1 != contact.patches.size()) return;
  materials.push_back(material);
  contact.restitution = contact.patches.size() == 1 ? material.restitution
                                                    : std::max(contact.restitution, material.restitution);
  contact.materials = std::make_shared<const std::vector<ContactMaterial>>(std::move(materials));
}

}  // namespace tessera::native
