// Which patches are solved at the same time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tessera {

// Patches come in the order in which they are to be solved. Each goes to the first group with a free lane
// after the groups of all earlier patches that push one of its bodies. So groups in order, with the patches
// of a group at the same time, give what patches in order give; and in a group no pushed body occurs twice.
class PatchGroups {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  // Forgets all patches. Bodies have places below `bodies`; groups have so many lanes, at most 255.
  void clear(std::size_t bodies, std::size_t lanes);

  // Patches to come go to groups after all present ones.
  void fence() { fence_ = static_cast<std::uint32_t>(used_.size()); }

  // The group of the next patch, which pushes these bodies; kNone for one that cannot be pushed.
  std::size_t add(std::uint32_t a, std::uint32_t b);

  // The next patch goes to no group.
  void skip() { ++added_; }

  std::size_t size() const { return used_.size(); }

  // The patches of a group by lane, of which the last ones may be free (kNone).
  std::span<const std::uint32_t> operator[](std::size_t group) const {
    return std::span(patches_).subspan(group * lanes_, lanes_);
  }

 private:
  std::uint32_t first_free(std::uint32_t group);

  std::size_t lanes_ = 1;
  std::uint32_t added_ = 0;
  std::uint32_t fence_ = 0;
  std::vector<std::uint32_t> next_;     // by body: the first group after those that push it
  std::vector<std::uint32_t> free_;     // by group: itself while a lane is free; else a later group
  std::vector<std::uint8_t> used_;      // by group: lanes
  std::vector<std::uint32_t> patches_;  // by group and lane
};

}  // namespace tessera
