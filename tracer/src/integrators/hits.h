#pragma once
/// What the accelerator answered for a queue of rays.

#include <vector>

#include "tracer/src/interaction/surface.h"

namespace tracer {

/// Answers of the accelerator, one per ray of a span, and room for more.
struct Hits {
  std::vector<PrimitiveRef> primitive;
  std::vector<double> t, u, v;

  /// Only ever grows: what is added to a vector is written twice.
  HitSpan room_for(std::size_t count) {
    if (primitive.size() < count) {
      primitive.resize(count);
      for (auto* values : {&t, &u, &v}) values->resize(count);
    }
    return span();
  }
  [[nodiscard]] HitSpan span() { return {primitive.data(), t.data(), u.data(), v.data()}; }
  [[nodiscard]] Hit at(std::size_t i) const { return {primitive[i], t[i], u[i], v[i]}; }
};

}  // namespace tracer
