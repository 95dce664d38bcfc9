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

SectorIndex block_of(const SectorIndex& sector, ContactGroup group, const SectorIndex& anchor) {
  const auto block = [&](std::int64_t index, std::int64_t origin, int axis) {
    const std::uint64_t shift = ((group - kSeamGroup) >> axis) & 1;
    const std::uint64_t offset =
        static_cast<std::uint64_t>(index) - static_cast<std::uint64_t>(origin) + shift;
    return static_cast<std::int64_t>(offset >> 1);
  };
  return {block(sector.i, anchor.i, 0), block(sector.j, anchor.j, 1), block(sector.k, anchor.k, 2)};
}

std::vector<std::uint32_t> solve_order(std::span<const ContactToOrder> contacts, std::size_t bodies) {
  // Greedily, in the order of ids: the first colour that neither body has in the group.
  std::array<std::vector<std::uint64_t>, kContactGroups> taken;  // bits: the colours of each body
  std::vector<std::uint16_t> place(contacts.size());             // by group, then colour
  std::array<std::uint32_t, kContactGroups * kColoursMax + 1> begin{};
  for (std::size_t n = 0; n < contacts.size(); ++n) {
    const ContactToOrder& contact = contacts[n];
    std::vector<std::uint64_t>& colours = taken[contact.group];
    if (colours.empty()) colours.assign(bodies, 0);
    std::uint64_t used = 0;
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body != ContactToOrder::kFixed) used |= colours[body];
    }
    const int colour = std::min(std::countr_one(used), kColoursMax - 1);
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body != ContactToOrder::kFixed) colours[body] |= std::uint64_t{1} << colour;
    }
    place[n] = static_cast<std::uint16_t>(contact.group * kColoursMax + colour);
    ++begin[place[n] + 1];
  }
  for (std::size_t n = 1; n < begin.size(); ++n) begin[n] += begin[n - 1];
  std::vector<std::uint32_t> order(contacts.size());
  for (std::size_t n = 0; n < contacts.size(); ++n) order[begin[place[n]]++] = static_cast<std::uint32_t>(n);
  return order;
}

}  // namespace tessera
