#pragma once
/// What the accelerator answered for a queue of rays.

#include <vector>

#include "tracer/src/shapes/surface.h"

namespace tracer {

/// Answers of the accelerator, one per ray of a span.
struct Hits {
  std::vector<PrimitiveRef> primitive;
  std::vector<double> t, u, v;

  HitSpan resized(std::size_t count) {
    primitive.resize(count);
    t.resize(count);
    u.resize(count);
    v.resize(count);
    return span();
  }
  [[nodiscard]] HitSpan span() { return {primitive.data(), t.data(), u.data(), v.data()}; }
  [[nodiscard]] Hit at(std::size_t i) const { return {primitive[i], t[i], u[i], v[i]}; }
};

}  // namespace tracer
