#include "linalg/kernels.hpp"

#include <atomic>
#include <cstring>

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

struct Set {
  const Kernels* kernels;
  bool available;
};

const Set* sets(std::size_t& count) {
#ifdef MJTACTILE_X86
  static const Processor processor;
  static const Set all[] = {
      {&avx512::kKernels, processor.avx512},
      {&avx2::kKernels, processor.avx2},
      {&plain::kKernels, true},
  };
#else
  static const Set all[] = {{&plain::kKernels, true}};
#endif
  count = sizeof all / sizeof all[0];
  return all;
}

const Kernels* best() {
  std::size_t count;
  const Set* all = sets(count);
  while (!all->available) ++all;
  return all->kernels;
}

std::atomic<const Kernels*>& current() {
  static std::atomic<const Kernels*> chosen{best()};
  return chosen;
}

}  // namespace

const Kernels& kernels() { return *current().load(std::memory_order_relaxed); }

bool use_kernels(const char* name) {
  std::size_t count;
  const Set* all = sets(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (all[i].available && std::strcmp(all[i].kernels->name, name) == 0) {
      current().store(all[i].kernels);
      return true;
    }
  }
  return false;
}

}  // namespace mjtactile
