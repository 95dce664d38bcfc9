// Compiled for AVX2: called only where the processor has it.
#include "lpss/solver/contact_kernel.h"

namespace tessera {

constinit const ContactKernel<float> kContactKernelFloat8 = Kernel<Lanes<float, 8>>::kTable;
constinit const ContactKernel<double> kContactKernelDouble4 = Kernel<Lanes<double, 4>>::kTable;

}  // namespace tessera
