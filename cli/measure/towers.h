// How towers fare: the measure by which runs of the same world are compared.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/world_description.h"

namespace tessera {

// A tower stands if its top body ends nearer than this (m) to where it began: half a crate, so that none has
// fallen.
inline constexpr double kStandingDisplacementMax = 0.5;

struct TowerReport {
  std::size_t towers = 0;
  std::size_t standing = 0;
  // m, of all bodies of all towers; infinite for what is no number any longer.
  double displacement_median = 0;
  double displacement_max = 0;
};

// The towers of a world: models whose names start with "tower", on any level, with two dynamic bodies or
// more. The top of a tower is the body that is farthest up, against gravity, at the start.
class Towers {
 public:
  // `start` are the world's bodies as records_of() gives them.
  Towers(const WorldDescription& world, const std::vector<BodyRecord>& start);

  bool empty() const { return towers_.empty(); }

  // Where the bodies went. Tell of every body once; those of no tower are ignored. Positions that are no
  // numbers count as infinitely far away, and so do bodies that were never told of.
  void set_end(const BodyRecord& record);

  TowerReport report() const;

 private:
  struct Block {
    SectorIndex home;
    Eigen::Vector3d position;
    double displacement;
  };
  struct Tower {
    BodyId top;
    std::vector<BodyId> blocks;
  };

  double sector_size_;
  std::map<BodyId, Block> blocks_;
  std::vector<Tower> towers_;
};

}  // namespace tessera
