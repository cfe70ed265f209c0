// One set of kernels per instruction set; those for x86 are compiled on x86 only. The sets are constants: asking for
// one runs none of its instructions, so the processor need not have them.
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
