#include "lpss/joints/block_loops.h"

namespace tessera::joints {

constinit const BlockKernel kBlockKernelSse2 = kLoops;

}  // namespace tessera::joints
