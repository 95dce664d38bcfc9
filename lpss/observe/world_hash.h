// One number for the state of a world, by which runs are compared.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <vector>

#include "lpss/model/body.h"

namespace tessera {

// The sum over all bodies of a 128-bit hash (XXH3) of id, home sector, pose and velocities, bit for bit. A
// sum does not depend on order, so servers add up theirs. Homes count relative to the world's anchor, or to
// the origin of a frame that moves: moving a world by whole sectors does not change its hash.
class WorldHash {
 public:
  void add(const BodyRecord& record, const SectorIndex& anchor);
  void add(const WorldHash& other);

  // Likewise of the numbers of all programs of a body, and of why they were stopped: for a hash apart from
  // that of bodies.
  void add_programs(BodyId body, const std::vector<ProgramRecord>& programs);

  // 32 hexadecimal digits.
  std::string to_string() const;

  std::uint64_t low() const { return low_; }
  std::uint64_t high() const { return high_; }
  WorldHash() = default;
  WorldHash(std::uint64_t low, std::uint64_t high) : low_(low), high_(high) {}

  friend bool operator==(const WorldHash&, const WorldHash&) = default;

 private:
  std::uint64_t low_ = 0;
  std::uint64_t high_ = 0;
};

}  // namespace tessera
