// The threads on which loops run.
#pragma once

#include "lpss/base/parallel.h"

namespace tessera {

// Of a loop over the bodies of a sector.
inline constexpr std::size_t kBodiesInPiece = 256;

// A loop over `threads` threads of this process; threads >= 1. Empty for one: see run_parallel().
ParallelFor parallel_on(int threads);

}  // namespace tessera
