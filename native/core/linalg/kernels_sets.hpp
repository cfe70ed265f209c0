// One set of kernels per instruction set. The sets for x86 are compiled on x86 only. They are constants, so that
// referring to one runs none of its instructions, which the processor may lack.
#pragma once

#include "linalg/kernels.hpp"

namespace mjtactile {

namespace plain {
extern const Kernels kKernels;
}

#ifdef MJTACTILE_X86
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}
#endif

}  // namespace mjtactile
