#include "linalg/kernels.hpp"

#include <atomic>
#include <cstring>

#include "linalg/kernels_sets.hpp"

namespace mjtactile {
namespace {

struct Set {
  const Kernels* kernels;
  bool available;
};

const Set* sets(std::size_t& count) {
#ifdef MJTACTILE_X86
  static const Set all[] = {
      {&avx512::kKernels, __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma")},
      {&avx2::kKernels,
       __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("f16c")},
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
