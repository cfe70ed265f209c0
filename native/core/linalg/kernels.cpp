#include "linalg/kernels.hpp"

#include <atomic>
#include <cstring>
#include <vector>

#include "linalg/kernels_sets.hpp"

#ifdef MJTACTILE_X86
#include <cpuid.h>
#endif

namespace mjtactile {
namespace {

#ifdef MJTACTILE_X86
// Wide instruction sets that the processor has and whose registers the operating system saves. The processor is asked
// itself: __builtin_cpu_supports asks the compiler's run-time library, and that of Zig, which wheels are compiled with,
// denies every instruction set.
struct Processor {
  bool avx2 = false, avx512 = false;

  Processor() {
    unsigned eax, ebx, ecx, edx;
    if (!__get_cpuid(1, &eax, &ebx, &ecx, &edx) || !(ecx & bit_OSXSAVE)) return;
    const bool has_fma_and_halves = (ecx & bit_FMA) && (ecx & bit_F16C);
    unsigned saved, upper;  // one bit for each kind of registers that the operating system saves
    __asm__("xgetbv" : "=a"(saved), "=d"(upper) : "c"(0));
    if (!has_fma_and_halves || !__get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx)) return;
    constexpr unsigned kAvx = 0x06, kAvx512 = 0xe6;  // xmm, ymm; also mask registers and both parts of zmm
    avx2 = (ebx & bit_AVX2) && (saved & kAvx) == kAvx;
    avx512 = avx2 && (ebx & bit_AVX512F) && (saved & kAvx512) == kAvx512;
  }
};
#endif

// The sets that the processor has, the best first.
std::vector<const Kernels*> sets() {
  std::vector<const Kernels*> found;
#ifdef MJTACTILE_X86
  const Processor processor;
  if (processor.avx512) found.push_back(&avx512::kKernels);
  if (processor.avx2) found.push_back(&avx2::kKernels);
#endif
  found.push_back(&plain::kKernels);
  return found;
}

std::atomic<const Kernels*>& current() {
  static std::atomic<const Kernels*> chosen{sets().front()};
  return chosen;
}

}  // namespace

const Kernels& kernels() { return *current().load(std::memory_order_relaxed); }

bool use_kernels(const char* name) {
  for (const Kernels* one : sets()) {
    if (std::strcmp(one->name, name) != 0) continue;
    current().store(one);
    return true;
  }
  return false;
}

}  // namespace mjtactile
