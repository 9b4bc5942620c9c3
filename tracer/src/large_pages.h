#pragma once
/// Memory of pictures in pages of 2 MiB. The one place that asks for them.

#include <sys/mman.h>

#include <cstdint>
#include <vector>

namespace tracer {

/// Room for `count` values, in large pages as far as it spans such and the kernel has them to give: meeting a picture's
/// pages one by one took a tenth of the time of simple scenes. Of an empty vector; throws what reserve() does.
template <class Value>
void reserve_in_large_pages(std::vector<Value>& values, std::size_t count) {
  constexpr std::uintptr_t page = std::uintptr_t{1} << 21;
  values.reserve(count);
  const auto first = reinterpret_cast<std::uintptr_t>(values.data());
  const std::uintptr_t begin = (first + page - 1) / page * page, end = (first + count * sizeof(Value)) / page * page;
  // Advice: where it is not taken, the pages are small.
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace tracer
