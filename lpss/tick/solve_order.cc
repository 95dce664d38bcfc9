#include "lpss/tick/solve_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

namespace tessera {
namespace {

// Contacts that find no colour share the last one, where they are solved by ids. Only a body with as many
// contacts in one group needs so many colours.
constexpr int kColoursMax = 64;

}  // namespace

ContactGroup group_of(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor) {
  const auto difference = [](std::int64_t x, std::int64_t y) {
    return static_cast<std::uint64_t>(x) - static_cast<std::uint64_t>(y);
  };
  ContactGroup bits = 0;
  bool same = true;
  for (const auto& [axis, x, y, origin] :
       {std::tuple(0, a.i, b.i, anchor.i), {1, a.j, b.j, anchor.j}, {2, a.k, b.k, anchor.k}}) {
    if (x == y) continue;
    same = false;
    const std::int64_t lower = std::min(x, y);
    if (difference(std::max(x, y), lower) > 1) return kFarGroup;
    bits |= static_cast<ContactGroup>((difference(lower, origin) & 1) << axis);
  }
  return same ? kInsideGroup : static_cast<ContactGroup>(kSeamGroup + bits);
}

std::vector<std::size_t> solve_order(std::span<const ContactToOrder> contacts, std::size_t bodies) {
  struct Place {
    ContactGroup group;
    std::uint8_t colour;
    std::size_t contact;
    bool operator<(const Place& other) const {
      return std::tie(group, colour, contact) < std::tie(other.group, other.colour, other.contact);
    }
  };
  // Greedily, in the order of ids: the first colour that neither body has in the group.
  std::array<std::vector<std::uint64_t>, kContactGroups> taken;  // bits: the colours of each body
  std::vector<Place> places;
  places.reserve(contacts.size());
  for (std::size_t n = 0; n < contacts.size(); ++n) {
    const ContactToOrder& contact = contacts[n];
    std::vector<std::uint64_t>& colours = taken[contact.group];
    if (colours.empty()) colours.assign(bodies, 0);
    const std::uint64_t used = (contact.a ? colours[*contact.a] : 0) | (contact.b ? colours[*contact.b] : 0);
    const int colour = std::min(std::countr_one(used), kColoursMax - 1);
    for (const std::optional<std::size_t>& body : {contact.a, contact.b}) {
      if (body) colours[*body] |= std::uint64_t{1} << colour;
    }
    places.push_back({contact.group, static_cast<std::uint8_t>(colour), n});
  }
  std::sort(places.begin(), places.end());
  std::vector<std::size_t> order;
  order.reserve(places.size());
  for (const Place& place : places) order.push_back(place.contact);
  return order;
}

}  // namespace tessera
