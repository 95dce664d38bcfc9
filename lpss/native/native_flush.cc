// Bodies on several fixed surfaces.
#include <algorithm>
#include <utility>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

constexpr std::size_t kFixedInPiece = 128;

}  // namespace

// Of bodies that touch a fixed one in a single patch, nothing more is looked at.
void NativeWorld::join_flush(const ParallelFor& parallel) {
  const auto contact_of = [&](const FixedCandidate& fixed) -> Contact& {
    return contacts_[static_cast<std::size_t>(candidates_[fixed.candidate].contact)];
  };
  fixed_of_body_.assign(bodies_.size(), 0);
  for (const FixedCandidate& fixed : fixed_) ++fixed_of_body_[static_cast<std::size_t>(fixed.body)];
  std::erase_if(fixed_, [&](const FixedCandidate& fixed) {
    return fixed_of_body_[static_cast<std::size_t>(fixed.body)] == 1 && contact_of(fixed).patches.size() == 1;
  });
  if (fixed_.empty()) return;
  std::sort(fixed_.begin(), fixed_.end(), [](const FixedCandidate& x, const FixedCandidate& y) {
    return std::pair(x.body, x.candidate) < std::pair(y.body, y.candidate);
  });
  const Pieces pieces(fixed_.size(), kFixedInPiece);
  if (flush_pieces_.size() < pieces.count()) flush_pieces_.resize(pieces.count());
  const auto is_first = [&](std::size_t n) { return n == 0 || fixed_[n].body != fixed_[n - 1].body; };
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    // A body belongs to the piece in which it begins.
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) {
      if (!is_first(n)) continue;
      std::vector<FixedContact>& contacts = flush_pieces_[piece].contacts;
      contacts.clear();
      for (std::size_t k = n; k == n || (k < fixed_.size() && !is_first(k)); ++k)
        contacts.push_back({&body(fixed_[k].body), &body(fixed_[k].fixed), &contact_of(fixed_[k])});
      flush_pieces_[piece].flush.join(contacts);
    }
  });
  for (const FixedCandidate& fixed : fixed_) {
    if (contact_of(fixed).patches.empty()) drop_contact(candidates_[fixed.candidate]);
  }
}

}  // namespace tessera::native
