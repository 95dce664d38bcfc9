#include "lpss/tick/solve_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <numeric>
#include <tuple>

namespace tessera {
namespace {

// Contacts that find no colour share the last one, where they are solved by ids. Only a body with as many
// contacts in one stage needs so many colours.
constexpr int kColoursMax = 64;

}  // namespace

ContactStage stage_of(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor_of_world) {
  const SectorIndex anchor = anchor_for(a, anchor_of_world);
  const auto difference = [](std::int64_t x, std::int64_t y) {
    return static_cast<std::uint64_t>(x) - static_cast<std::uint64_t>(y);
  };
  ContactStage bits = 0;
  bool same = true;
  for (const auto& [axis, x, y, origin] :
       {std::tuple(0, a.i, b.i, anchor.i), {1, a.j, b.j, anchor.j}, {2, a.k, b.k, anchor.k}}) {
    if (x == y) continue;
    same = false;
    const std::int64_t lower = std::min(x, y);
    if (difference(std::max(x, y), lower) > 1) return kFarStage;
    bits |= static_cast<ContactStage>((difference(lower, origin) & 1) << axis);
  }
  return same ? kInsideStage : static_cast<ContactStage>(kSeamStage + bits);
}

SectorIndex block_of(const SectorIndex& sector, ContactStage stage, const SectorIndex& anchor_of_world) {
  const SectorIndex anchor = anchor_for(sector, anchor_of_world);
  const auto block = [&](std::int64_t index, std::int64_t origin, int axis) {
    const std::uint64_t shift = ((stage - kSeamStage) >> axis) & 1;
    const std::uint64_t offset =
        static_cast<std::uint64_t>(index) - static_cast<std::uint64_t>(origin) + shift;
    return static_cast<std::int64_t>(offset >> 1);
  };
  return {block(sector.i, anchor.i, 0), block(sector.j, anchor.j, 1), block(sector.k, anchor.k, 2),
          sector.frame};
}

// Greedily, in the order of ids: the first colour that neither body has in the stage.
std::span<const std::uint32_t> SolveOrder::of(std::span<const ContactToOrder> contacts, std::size_t bodies) {
  for (std::vector<std::uint64_t>& colours : taken_) colours.clear();
  rank_.resize(contacts.size());
  std::array<std::uint32_t, kContactStages * kColoursMax> counts;
  const bool is_counted = contacts.size() > counts.size() / 4;
  if (is_counted) counts.fill(0);
  for (std::size_t n = 0; n < contacts.size(); ++n) {
    const ContactToOrder& contact = contacts[n];
    std::vector<std::uint64_t>& colours = taken_[contact.stage];
    if (colours.empty()) colours.assign(bodies, 0);
    std::uint64_t used = 0;
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body != ContactToOrder::kFixed) used |= colours[body];
    }
    const int colour = std::min(std::countr_one(used), kColoursMax - 1);
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body != ContactToOrder::kFixed) colours[body] |= std::uint64_t{1} << colour;
    }
    rank_[n] = static_cast<std::uint16_t>(contact.stage * kColoursMax + colour);
    if (is_counted) ++counts[rank_[n]];
  }
  order_.resize(contacts.size());
  if (!is_counted) {
    // For few, a list of ranks would be longer than the contacts.
    std::iota(order_.begin(), order_.end(), std::uint32_t{0});
    std::sort(order_.begin(), order_.end(), [this](std::uint32_t x, std::uint32_t y) {
      return std::tie(rank_[x], x) < std::tie(rank_[y], y);
    });
    return order_;
  }
  std::exclusive_scan(counts.begin(), counts.end(), counts.begin(), std::uint32_t{0});
  for (std::uint32_t n = 0; n < contacts.size(); ++n) order_[counts[rank_[n]]++] = n;
  return order_;
}

void SolveOrder::stage_ends(std::span<const ContactToOrder> contacts, std::size_t first,
                            std::vector<std::size_t>& ends) {
  ends.assign(kContactStages, 0);
  for (const ContactToOrder& contact : contacts) ++ends[contact.stage];
  std::inclusive_scan(ends.begin(), ends.end(), ends.begin(), std::plus<>(), first);
}

}  // namespace tessera
