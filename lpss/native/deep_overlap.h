// Two bodies of several parts that start deep in each other.
//
// Each pair of parts by itself comes apart the shortest way. Of parts that are deep in each other, these ways
// differ: a deck goes up, the feet below it go down, and the two bodies jam, harder with each step. So where
// a pair is so deep that its own way says nothing, and others press against it, all deep pairs come apart
// along one direction: the one along which the two bodies as they are have the shortest way out of each
// other.
#pragma once

#include <vector>

#include "lpss/native/body.h"
#include "lpss/native/contact.h"

namespace tessera::native {

// Of the points of such patches.
inline constexpr std::uint32_t kOneWayFeature = 0x3fff7fff;

// Replaces the patches of deep pairs of parts, and drops those that press against them, in what was found of
// a and b; `patches` otherwise stays as it is.
void open_one_way(const Body& a, const Body& b, std::vector<ContactPatch>& patches);

// Whether a contact has patches that open_one_way() has made.
inline bool is_opened_one_way(const Contact& contact) {
  for (const ContactPatch& patch : contact.patches) {
    if (patch.count == 1 && patch.point[0].feature == kOneWayFeature) return true;
  }
  return false;
}

}  // namespace tessera::native
