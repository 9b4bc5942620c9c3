#include "tracer/src/math/lanes.h"

#include <cstddef>
#include <cstring>

#if defined(__GNUC__) && !defined(__clang__) && !defined(WHITTLE_SANITIZED) && !defined(WHITTLE_AVX2) && \
    defined(__x86_64__)
#define WHITTLE_COMPRESSES
#include <immintrin.h>
#endif

namespace tracer {
namespace {

template <std::size_t size>
void compress_one_by_one(const Compressed* components, int count, LaneMask mask) {
  std::size_t lane[lanes];
  int kept = 0;
  for_each_lane(mask, [&](int i) { lane[kept++] = static_cast<std::size_t>(i); });
  for (int component = 0; component < count; ++component) {
    const auto* from = static_cast<const std::byte*>(components[component].from);
    auto* to = static_cast<std::byte*>(components[component].to);
    if (kept == lanes) {
      std::memcpy(to, from, lanes * size);
    } else {
      for (int i = 0; i < kept; ++i, to += size) std::memcpy(to, from + lane[i] * size, size);
    }
  }
}

#ifdef WHITTLE_COMPRESSES
// AVX-512 has an instruction for this, which compilers do not generate from loops. The version is selected at load time
// like those of WHITTLE_WIDE.
#define WHITTLE_COMPRESSING __attribute__((target("arch=x86-64-v4")))
#define WHITTLE_PLAIN __attribute__((target("default")))

WHITTLE_COMPRESSING void eights(const Compressed* components, int count, LaneMask mask) {
  const auto low = static_cast<__mmask8>(mask & 0xffu), high = static_cast<__mmask8>(mask >> 8);
  const int behind = std::popcount(mask & 0xffu);
  for (int i = 0; i < count; ++i) {
    const auto* from = static_cast<const double*>(components[i].from);
    auto* to = static_cast<double*>(components[i].to);
    const __m512d first = _mm512_maskz_compress_pd(low, _mm512_loadu_pd(from));
    const __m512d second = _mm512_maskz_compress_pd(high, _mm512_loadu_pd(from + 8));
    _mm512_storeu_pd(to, first);
    _mm512_storeu_pd(to + behind, second);
  }
}

WHITTLE_COMPRESSING void fours(const Compressed* components, int count, LaneMask mask) {
  for (int i = 0; i < count; ++i)
    _mm512_storeu_si512(components[i].to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask),
                                                                      _mm512_loadu_si512(components[i].from)));
}
#else
#define WHITTLE_PLAIN
#endif

WHITTLE_PLAIN void eights(const Compressed* components, int count, LaneMask mask) {
  compress_one_by_one<8>(components, count, mask);
}

WHITTLE_PLAIN void fours(const Compressed* components, int count, LaneMask mask) {
  compress_one_by_one<4>(components, count, mask);
}

}  // namespace

void compress_eights(const Compressed* components, int count, LaneMask mask) { eights(components, count, mask); }

void compress_fours(const Compressed* components, int count, LaneMask mask) { fours(components, count, mask); }

}  // namespace tracer
