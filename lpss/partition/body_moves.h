// Where bodies have come, gone or been woken in a partition, for whoever tells others what has changed
// (lpss/observe/body_changes.h).
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/grid/sector_index.h"
#include "lpss/model/body.h"

namespace tessera {

// Notes cost nothing until somebody takes them, and end where nobody does any more.
class BodyMoves {
 public:
  struct Notes {
    std::vector<SectorIndex> stirred;  // sectors that ticks look at again
    std::vector<SectorIndex> arrived;  // sectors that have come from other servers, with all that is in them
    std::vector<BodyId> left;          // bodies that have left a sector, for another one or for good

    std::size_t size() const { return stirred.size() + arrived.size() + left.size(); }
  };
  static constexpr std::size_t kNotesMax = std::size_t{1} << 16;

  void note_stirred(const SectorIndex& sector) {
    if (notes_) add(notes_->stirred, sector);
  }
  void note_arrived(const SectorIndex& sector) {
    if (notes_) add(notes_->arrived, sector);
  }
  void note_left(BodyId body) {
    if (notes_) add(notes_->left, body);
  }

  // Since the last call, in any order, some more than once. Nothing where that is not known: at the first
  // call, and where it is too much.
  std::optional<Notes> take() { return std::exchange(notes_, Notes()); }

 private:
  template <typename T>
  void add(std::vector<T>& list, const T& item) {
    list.push_back(item);
    if (notes_->size() > kNotesMax) notes_.reset();
  }

  std::optional<Notes> notes_;
};

}  // namespace tessera
