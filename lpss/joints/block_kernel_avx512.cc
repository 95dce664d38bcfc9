// Compiled for AVX-512: called only where the processor has it.
#include "lpss/joints/block_loops.h"

namespace tessera::joints {

constinit const BlockKernel kBlockKernelAvx512 = kLoops;

}  // namespace tessera::joints
