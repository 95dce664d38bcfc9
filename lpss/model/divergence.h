// Bodies that diverged: each is stopped where the tick found it, and reported.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "lpss/base/divergence_kind.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"

namespace tessera {

// A body that diverged in a tick.
struct Divergence {
  std::uint64_t tick = 0;
  BodyId body;
  JointId joint;  // of its joints, the one whose error is largest; 0: none holds it
  DivergenceKind kind = DivergenceKind::kPosition;

  auto key() const { return std::tie(tick, body, kind, joint); }
  friend bool operator==(const Divergence& a, const Divergence& b) { return a.key() == b.key(); }
  friend bool operator<(const Divergence& a, const Divergence& b) { return a.key() < b.key(); }
};

// Each server tells of so many in a tick, and so many are kept of a world: the first ones. All are counted.
inline constexpr std::size_t kDivergencesKept = 64;

inline std::span<const Divergence> first_divergences(const std::vector<Divergence>& ascending) {
  return std::span(ascending).first(std::min(ascending.size(), kDivergencesKept));
}

}  // namespace tessera
