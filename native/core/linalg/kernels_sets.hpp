// One set of kernels per instruction set; those for x86 are compiled on x86 only.
#pragma once

#include "linalg/kernels.hpp"

namespace mjtactile {

namespace plain {
Kernels make();
}

#ifdef MJTACTILE_X86
namespace avx2 {
Kernels make();
}
namespace avx512 {
Kernels make();
}
#endif

}  // namespace mjtactile
