// Bodies in one place: of a crowd's contacts, the deepest are enough, and all of them too many.
#include <algorithm>
#include <limits>
#include <tuple>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// A body that touches more dynamic ones is in a crowd: around one like itself there is room for far fewer.
constexpr std::uint32_t kPairsMax = 64;

Scalar least_gap(const Contact& contact) {
  Scalar least = std::numeric_limits<Scalar>::max();
  for (const ContactPatch& patch : contact.patches) {
    for (int n = 0; n < patch.count; ++n) least = std::min(least, patch.point[n].gap);
  }
  return least;
}

void forget_impulses(Contact& contact) {
  for (ContactPatch& patch : contact.patches) {
    patch.friction_impulse.setZero();
    patch.twist_impulse = 0;
    patch.rolling_impulse.setZero();
    for (int n = 0; n < patch.count; ++n) patch.point[n].impulse = 0;
  }
}

}  // namespace

// Drops the pairs of two bodies in crowds that are not among the deepest of either, by (gap, id).
void NativeWorld::thin_crowds() {
  pairs_of_body_.assign(bodies_.size(), 0);
  const auto count_of = [&](BodySlot slot) -> std::uint32_t& {
    return pairs_of_body_[static_cast<std::size_t>(slot)];
  };
  std::uint32_t most = 0;
  for (const ContactPair& pair : pairs_) {
    if (!body(pair.slot_a).is_dynamic() || !body(pair.slot_b).is_dynamic()) continue;
    most = std::max({most, ++count_of(pair.slot_a), ++count_of(pair.slot_b)});
  }
  if (most <= kPairsMax) return;

  // Those of two crowded bodies, once for each of the two.
  struct Crowded {
    BodyId body;
    Scalar gap;
    BodyId other;
    std::size_t pair;
    auto key() const { return std::tuple(body, gap, other); }
  };
  std::vector<Crowded> crowded;
  std::vector<bool> is_kept(pairs_.size(), true);
  for (std::size_t n = 0; n < pairs_.size(); ++n) {
    const ContactPair& pair = pairs_[n];
    if (count_of(pair.slot_a) <= kPairsMax || count_of(pair.slot_b) <= kPairsMax) continue;
    const Scalar gap = least_gap(contact(n));
    crowded.push_back({pair.a, gap, pair.b, n});
    crowded.push_back({pair.b, gap, pair.a, n});
    is_kept[n] = false;
  }
  std::sort(crowded.begin(), crowded.end(),
            [](const Crowded& x, const Crowded& y) { return x.key() < y.key(); });
  std::size_t first = 0;
  for (std::size_t n = 0; n < crowded.size(); ++n) {
    if (crowded[n].body != crowded[first].body) first = n;
    if (n - first < kPairsMax) is_kept[crowded[n].pair] = true;
  }

  std::size_t kept = 0;
  for (std::size_t n = 0; n < pairs_.size(); ++n) {
    if (!is_kept[n]) {
      forget_impulses(contact(n));
      continue;
    }
    pairs_[kept] = pairs_[n];
    contact_of_pair_[kept++] = contact_of_pair_[n];
  }
  pairs_.resize(kept);
  contact_of_pair_.resize(kept);
}

}  // namespace tessera::native
