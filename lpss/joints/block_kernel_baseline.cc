#include "lpss/joints/block_loops.h"

namespace tessera::joints {

constinit const BlockKernel kBlockKernelBaseline = kLoops;

}  // namespace tessera::joints
