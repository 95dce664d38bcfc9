#include "lpss/solver/patch_groups.h"

#include <algorithm>

namespace tessera {

void PatchGroups::clear(std::size_t bodies, std::size_t lanes) {
  lanes_ = lanes;
  added_ = 0;
  fence_ = 0;
  next_.assign(bodies, 0);
  free_.assign(1, 0);
  used_.clear();
  patches_.clear();
}

// Follows the links of full groups, and shortens them.
std::uint32_t PatchGroups::first_free(std::uint32_t group) {
  while (free_[group] != group) {
    free_[group] = free_[free_[group]];
    group = free_[group];
  }
  return group;
}

std::size_t PatchGroups::add(std::uint32_t a, std::uint32_t b) {
  std::uint32_t group = fence_;
  if (a != kNone) group = std::max(group, next_[a]);
  if (b != kNone) group = std::max(group, next_[b]);
  group = first_free(group);
  if (group == used_.size()) {
    used_.push_back(0);
    patches_.resize(patches_.size() + lanes_, kNone);
    free_.push_back(group + 1);
  }
  patches_[group * lanes_ + used_[group]] = added_++;
  if (++used_[group] == lanes_) free_[group] = group + 1;
  if (a != kNone) next_[a] = group + 1;
  if (b != kNone) next_[b] = group + 1;
  return group;
}

}  // namespace tessera
