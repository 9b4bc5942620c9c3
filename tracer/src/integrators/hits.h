#pragma once
/// Intersections of a queue of rays.

#include <vector>

#include "tracer/src/interaction/surface.h"

namespace tracer {

/// One intersection per ray, in arrays.
struct Hits {
  std::vector<PrimitiveRef> primitive;
  std::vector<double> t, u, v;

  /// Never shrinks: elements added to a vector are initialized first.
  HitSpan resize_to_fit(std::size_t count) {
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
