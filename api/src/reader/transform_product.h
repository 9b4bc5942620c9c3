#pragma once
/// Products of transforms.

#include <array>
#include <cstddef>

#include "tracer/scene.h"

namespace api {

/// The transform that applies `first`, then `then`.
inline tracer::Transform composed(const tracer::Transform& then, const tracer::Transform& first) {
  tracer::Transform product;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const std::array<double, 4>& r = then.rows[i];
      product.rows[i][j] =
          r[0] * first.rows[0][j] + r[1] * first.rows[1][j] + r[2] * first.rows[2][j] + (j == 3 ? r[3] : 0.0);
    }
  return product;
}

}  // namespace api
