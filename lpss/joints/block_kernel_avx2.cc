// Compiled for AVX2: called only where the processor has it.
#include "lpss/joints/block_loops.h"

namespace tessera::joints {

constinit const BlockKernel kBlockKernelAvx2 = kLoops;

}  // namespace tessera::joints
