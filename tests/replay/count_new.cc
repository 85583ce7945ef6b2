#include "tests/replay/count_new.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<long> news = 0;
}  // namespace

void* operator new(std::size_t size) {
  ++news;
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++news;
  const auto unit = static_cast<std::size_t>(alignment);
  if (void* p = std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace gapscope::testing {
long NewsSoFar() { return news; }
}  // namespace gapscope::testing
