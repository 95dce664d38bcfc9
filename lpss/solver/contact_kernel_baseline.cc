#include "lpss/solver/contact_kernel.h"

namespace tessera {

constinit const ContactKernel<float> kContactKernelFloat1 = Kernel<Lanes<float, 1>>::kTable;
constinit const ContactKernel<float> kContactKernelFloat4 = Kernel<Lanes<float, 4>>::kTable;
constinit const ContactKernel<double> kContactKernelDouble1 = Kernel<Lanes<double, 1>>::kTable;
constinit const ContactKernel<double> kContactKernelDouble2 = Kernel<Lanes<double, 2>>::kTable;

}  // namespace tessera
