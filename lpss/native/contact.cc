#include "lpss/native/contact.h"

#include <cstring>

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
void visit_point(P& point, const Visit& visit) {
  for (auto* v : {&point.on_a, &point.on_b}) {
    for (int n = 0; n < 3; ++n) visit((*v)[n]);
  }
  visit(point.gap);
  visit(point.impulse);
  visit(point.feature);
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(T& value) const {
    if (bytes_.size() < sizeof(value)) {
      is_short_ = true;
      return;
    }
    std::memcpy(&value, bytes_.data(), sizeof(value));
    bytes_.remove_prefix(sizeof(value));
  }
  void operator()(bool& value) const {
    std::uint8_t byte = 0;
    (*this)(byte);
    value = byte != 0;
  }
  bool is_short() const { return is_short_; }
  bool at_end() const { return bytes_.empty(); }

 private:
  mutable std::string_view bytes_;
  mutable bool is_short_ = false;
};

constexpr std::uint32_t kPatchesMax = 1 << 16;

}  // namespace

bool Contact::is_touching() const {
  for (const ContactPatch& patch : patches) {
    for (int n = 0; n < patch.count; ++n) {
      if (patch.point[n].gap <= 0 || patch.point[n].impulse > 0) return true;
    }
  }
  return false;
}

void drop_predicted(Contact& contact) {
  while (!contact.patches.empty() && contact.patches.back().is_predicted) contact.patches.pop_back();
}

std::string encode(const Contact& contact) {
  std::string bytes;
  const auto write = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  write(static_cast<std::uint8_t>(sizeof(Scalar)));
  visit_header(contact, write);
  write(static_cast<std::uint32_t>(contact.patches.size()));
  for (const ContactPatch& patch : contact.patches) {
    visit_patch(patch, write);
    for (int n = 0; n < patch.count; ++n) visit_point(patch.point[n], write);
  }
  return bytes;
}

bool decode(std::string_view bytes, Contact& contact) {
  const Reader read(bytes);
  std::uint8_t size = 0;
  read(size);
  if (size != sizeof(Scalar)) return false;
  contact = {};
  visit_header(contact, read);
  std::uint32_t patches = 0;
  read(patches);
  if (patches > kPatchesMax) return false;
  for (std::uint32_t p = 0; p < patches && !read.is_short(); ++p) {
    ContactPatch& patch = contact.patches.emplace_back();
    visit_patch(patch, read);
    if (patch.count > kPatchPointsMax) return false;
    for (int n = 0; n < patch.count; ++n) visit_point(patch.point[n], read);
  }
  return !read.is_short() && read.at_end();
}

}  // namespace tessera::native
