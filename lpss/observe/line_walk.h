// The sectors that may know something of what is near a line, in the order in which the line comes to them:
// on its path from sector to sector or, where it is long and these are few, one by one of those that there
// are.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/observe/sector_path.h"

namespace tessera {

class LineWalk {
 public:
  explicit LineWalk(SectorPath path) : path_(std::move(path)) {}
  explicit LineWalk(std::vector<LinePlace> places) : places_(std::move(places)) {
    std::ranges::sort(places_, {},
                      [](const LinePlace& place) { return std::pair(place.stretch.begin, place.index); });
  }

  bool is_done() const { return path_ ? is_at_end_ : next_ == places_.size(); }

  // m along the line, of the next ones; infinite at the end.
  double begin() const {
    if (is_done()) return std::numeric_limits<double>::infinity();
    return path_ ? path_->begin() : places_[next_].stretch.begin;
  }

  // Calls visit(place) for the next ones: each place in one call alone.
  template <typename Visit>
  void visit(const Visit& visit) {
    if (!path_) return visit(places_[next_++]);
    path_->for_each_around(visit);
    is_at_end_ = !path_->advance();
  }

 private:
  std::optional<SectorPath> path_;
  bool is_at_end_ = false;  // of the path
  std::vector<LinePlace> places_;
  std::size_t next_ = 0;
};

}  // namespace tessera
