// The order in which contacts are solved: a property of the world, whoever solves them.
//
// A pass goes through the contacts by group, in a group by colour, and in a colour by ids. The groups:
//
//   inside   both bodies have the same home sector. Sectors share no body.
//   seams    the homes are neighbours: 8 groups. On an axis where the homes differ, the group's bit is the
//            parity of the lower one, counted from the world's anchor; elsewhere it is 0. So sectors group
//            into blocks of two by two by two, shifted by the bits: both homes of a contact are in one block,
//            and blocks share no body.
//   far      the homes are more than one sector apart.
//   fixed    one side cannot be pushed (static and kinematic bodies). Last, since what carries everything
//            must give way least.
//
// In a group no body occurs twice in a colour. So contacts of one colour, of different sectors (inside), or
// of different blocks (seams) commute: who solves them, and in how many threads or lanes, changes no bit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "lpss/grid/sector_index.h"

namespace tessera {

using ContactGroup = std::uint8_t;

inline constexpr ContactGroup kInsideGroup = 0;
inline constexpr ContactGroup kSeamGroup = 1;  // and the seven after it
inline constexpr ContactGroup kSeamGroups = 8;
inline constexpr ContactGroup kFarGroup = 9;
inline constexpr ContactGroup kFixedGroup = 10;
inline constexpr std::size_t kContactGroups = 11;

// Of a contact between bodies with these homes, in a world with this anchor.
ContactGroup group_of(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor);

// The block of a group of seams that a sector belongs to: the index is of blocks.
SectorIndex block_of(const SectorIndex& sector, ContactGroup group, const SectorIndex& anchor);

// A contact to be ordered. `a` and `b` are places in a list of bodies; kFixed for what cannot be pushed.
struct ContactToOrder {
  ContactGroup group = kInsideGroup;
  std::uint32_t a = kFixed;
  std::uint32_t b = kFixed;

  static constexpr std::uint32_t kFixed = ~std::uint32_t{0};
};

// Orders contacts, which ascend by ids. Keeps its storage.
class SolveOrder {
 public:
  // The places of `contacts` in the order of solving. `bodies` is the length of their list. Valid until the
  // next call.
  std::span<const std::uint32_t> of(std::span<const ContactToOrder> contacts, std::size_t bodies);

  // Where each group ends in that order, which begins at `first`.
  static void group_ends(std::span<const ContactToOrder> contacts, std::size_t first,
                         std::vector<std::size_t>& ends);

 private:
  std::array<std::vector<std::uint64_t>, kContactGroups> taken_;  // bits: the colours of each body
  std::vector<std::uint16_t> rank_;                               // of each contact: group, then colour
  std::vector<std::uint32_t> order_;
};

}  // namespace tessera
