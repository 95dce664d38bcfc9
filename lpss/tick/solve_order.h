// The order in which contacts are solved: a property of the world, whoever solves them.
//
// A pass goes through the contacts by stage, in a stage by colour, and in a colour by ids. The stages:
//
//   inside   both bodies have the same home sector. Sectors share no body.
//   seams    the homes are neighbours: 8 stages. On an axis where the homes differ, the stage's bit is the
//            parity of the lower one, counted from the world's anchor; elsewhere it is 0. So sectors fall
//            into blocks of two by two by two, shifted by the bits: both homes of a contact are in one block,
//            and blocks share no body.
//   far      the homes are more than one sector apart.
//   fixed    one side cannot be pushed (static and kinematic bodies). Last, since what carries everything
//            must give way least.
//
// In a stage no body occurs twice in a colour. So contacts of one colour, of different sectors (inside), or
// of different blocks (seams) commute: who solves them, and in how many threads or lanes, changes no bit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "lpss/grid/sector_index.h"

namespace tessera {

using ContactStage = std::uint8_t;

inline constexpr ContactStage kInsideStage = 0;
inline constexpr ContactStage kSeamStage = 1;  // and the seven after it
inline constexpr ContactStage kSeamStages = 8;
inline constexpr ContactStage kFarStage = 9;
inline constexpr ContactStage kFixedStage = 10;
inline constexpr std::size_t kContactStages = 11;

// Of a contact between bodies with these homes, in a world with this anchor.
ContactStage stage_of(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor);

// The block of a stage of seams that a sector belongs to: the index is of blocks.
SectorIndex block_of(const SectorIndex& sector, ContactStage stage, const SectorIndex& anchor);

// A contact to be ordered. `a` and `b` are places in a list of bodies; kFixed for what cannot be pushed.
struct ContactToOrder {
  ContactStage stage = kInsideStage;
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

  // Where each stage ends in that order, which begins at `first`.
  static void stage_ends(std::span<const ContactToOrder> contacts, std::size_t first,
                         std::vector<std::size_t>& ends);

 private:
  std::array<std::vector<std::uint64_t>, kContactStages> taken_;  // bits: the colours of each body
  std::vector<std::uint16_t> rank_;                               // of each contact: stage, then colour
  std::vector<std::uint32_t> order_;
};

}  // namespace tessera
