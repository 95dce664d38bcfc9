#include "lpss/native/contact.h"

#include <algorithm>

#include "lpss/base/bytes.h"

namespace tessera::native {
namespace {

// Calls `visit` with every number of a contact, in a fixed order.
template <typename C, typename Visit>
void visit_header(C& contact, const Visit& visit) {
  visit(contact.friction);
  visit(contact.restitution);
  visit(contact.is_found);
  for (int n = 0; n < 9; ++n) visit(contact.found_at.rotation(n / 3, n % 3));
  for (int n = 0; n < 3; ++n) visit(contact.found_at.position[n]);
  visit(contact.need.impulse);
  visit(contact.need.ticks);
  visit(contact.need.substeps);
}

template <typename S, typename Visit>
void visit_contact_surface(S& surface, const Visit& visit) {
  for (auto* number : {&surface.along, &surface.across, &surface.torsion, &surface.rolling}) visit(*number);
  for (auto* v : {&surface.direction, &surface.velocity, &surface.running}) {
    for (int n = 0; n < 3; ++n) visit((*v)[n]);
  }
}

template <typename P, typename Visit>
void visit_patch(P& patch, const Visit& visit) {
  visit(patch.parts);
  visit(patch.is_fixed_to_a);
  visit(patch.is_predicted);
  visit(patch.count);
  visit(patch.twist_impulse);
  for (auto* v : {&patch.normal, &patch.fixed_normal, &patch.friction_impulse}) {
    for (int n = 0; n < 3; ++n) visit((*v)[n]);
  }
}

template <typename P, typename Visit>
void visit_contact_point(P& point, const Visit& visit) {
  for (auto* v : {&point.on_a, &point.on_b}) {
    for (int n = 0; n < 3; ++n) visit((*v)[n]);
  }
  visit(point.gap);
  visit(point.impulse);
  visit(point.feature);
}

constexpr std::uint32_t kPatchesMax = 1 << 16;

// What a contact has beyond what all have.
constexpr std::uint8_t kHasSurface = 1;
constexpr std::uint8_t kHasMaterials = 2;

void write_materials(const std::vector<ContactMaterial>& materials, const ByteWriter& write) {
  write(static_cast<std::uint32_t>(materials.size()));
  for (const ContactMaterial& material : materials) {
    write(material.friction);
    write(material.restitution);
    write(material.surface.has_value());
    if (material.surface) visit_contact_surface(*material.surface, write);
  }
}

bool read_materials(const ByteReader& read, Contact& contact) {
  const auto count = read.get<std::uint32_t>();
  if (count > kPatchesMax) return false;
  auto materials = std::make_shared<std::vector<ContactMaterial>>();
  for (std::uint32_t n = 0; n < count && !read.is_short(); ++n) {
    ContactMaterial& material = materials->emplace_back();
    read(material.friction);
    read(material.restitution);
    if (read.get<bool>()) visit_contact_surface(material.surface.emplace(), read);
  }
  contact.materials = std::move(materials);
  return true;
}

}  // namespace

bool ContactPatch::is_touching() const {
  return std::any_of(point, point + count, [](const ContactPoint& p) { return p.gap <= 0 || p.impulse > 0; });
}

bool Contact::is_touching() const {
  return std::ranges::any_of(patches, [](const ContactPatch& patch) { return patch.is_touching(); });
}

void drop_impulses(Contact& contact) {
  for (ContactPatch& patch : contact.patches) {
    patch.friction_impulse.setZero();
    patch.twist_impulse = 0;
    patch.rolling_impulse.setZero();
    for (ContactPoint& point : patch.point) point.impulse = 0;
  }
  contact.need = {};
}

void drop_predicted(Contact& contact) {
  while (contact.is_predicted()) contact.patches.pop_back();
  if (!contact.materials || contact.materials->size() <= contact.patches.size()) return;
  contact.materials = std::make_shared<const std::vector<ContactMaterial>>(
      contact.materials->begin(),
      contact.materials->begin() + static_cast<std::ptrdiff_t>(contact.patches.size()));
}

void turn_contact(const Matrix& turn, Contact& contact) {
  const auto turn_surface = [&](ContactSurface& surface) {
    for (Vector* v : {&surface.direction, &surface.velocity, &surface.running}) *v = turn * *v;
  };
  for (ContactPatch& patch : contact.patches) {
    for (Vector* v : {&patch.normal, &patch.friction_impulse, &patch.rolling_impulse}) *v = turn * *v;
  }
  if (contact.surface) {
    ContactSurface surface = *contact.surface;
    turn_surface(surface);
    contact.surface = std::make_shared<const ContactSurface>(surface);
  }
  if (!contact.materials) return;
  std::vector<ContactMaterial> materials = *contact.materials;
  for (ContactMaterial& material : materials) {
    if (material.surface) turn_surface(*material.surface);
  }
  contact.materials = std::make_shared<const std::vector<ContactMaterial>>(std::move(materials));
}

std::string encode(const Contact& contact) {
  std::string bytes;
  const ByteWriter write(bytes);
  write(static_cast<std::uint8_t>(sizeof(Scalar)));
  visit_header(contact, write);
  write(static_cast<std::uint8_t>((contact.surface ? kHasSurface : 0) |
                                  (contact.materials ? kHasMaterials : 0)));
  if (contact.surface) visit_contact_surface(*contact.surface, write);
  if (contact.materials) write_materials(*contact.materials, write);
  write(static_cast<std::uint32_t>(contact.patches.size()));
  for (const ContactPatch& patch : contact.patches) {
    visit_patch(patch, write);
    for (int n = 0; n < 3 && contact.has_surfaces(); ++n) write(patch.rolling_impulse[n]);
    for (int n = 0; n < patch.count; ++n) visit_contact_point(patch.point[n], write);
  }
  return bytes;
}

bool decode(std::string_view bytes, Contact& contact) {
  const ByteReader read(bytes);
  if (read.get<std::uint8_t>() != sizeof(Scalar)) return false;
  contact = {};
  visit_header(contact, read);
  if (contact.need.ticks > ContactNeed::kTicksToKnow || contact.need.substeps > ContactNeed::kSubstepsMost)
    return false;
  const auto has = read.get<std::uint8_t>();
  if (has > (kHasSurface | kHasMaterials)) return false;
  if (has & kHasSurface) {
    ContactSurface surface;
    visit_contact_surface(surface, read);
    contact.surface = std::make_shared<const ContactSurface>(surface);
  }
  if ((has & kHasMaterials) && !read_materials(read, contact)) return false;
  const auto patches = read.get<std::uint32_t>();
  if (patches > kPatchesMax) return false;
  for (std::uint32_t p = 0; p < patches && !read.is_short(); ++p) {
    ContactPatch& patch = contact.patches.emplace_back();
    visit_patch(patch, read);
    for (int n = 0; n < 3 && contact.has_surfaces(); ++n) read(patch.rolling_impulse[n]);
    if (patch.count > kPatchPointsMax) return false;
    for (int n = 0; n < patch.count; ++n) visit_contact_point(patch.point[n], read);
  }
  return read.at_end();
}

}  // namespace tessera::native
