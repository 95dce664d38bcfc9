// The threads on which loops run.
#pragma once

#include "lpss/base/parallel.h"

namespace tessera {

// Of a loop over sectors that looks at the bodies near their borders.
inline constexpr std::size_t kSectorsInPiece = 4;

// A loop over `threads` threads of this process; threads >= 1. Empty for one: see run_parallel().
ParallelFor parallel_on(int threads);

}  // namespace tessera
