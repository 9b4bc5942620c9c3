#pragma once
/// From pixels to the error told of their picture.

#include <span>

#include "tracer/render.h"
#include "tracer/src/accuracy/account.h"
#include "tracer/src/integrator/wavefront.h"

namespace tracer {

/// What a unit of weight that was not traced can hide: the scene's bound of radiance, or without one that of the
/// brightest pixel.
struct Hideable {
  double radiance = 0;
  bool bounded = true;
};
Hideable hideable(const CompiledScene& scene, double brightest_pixel);

/// Of all pixels; `rgb` are their means and `missing` what these lack (empty: nothing).
MissingError missing_error(std::span<const float> rgb, std::span<const MissingLight> missing, const Hideable& hideable,
                           const Levels& levels);

/// The layer `error` of a picture: of each pixel, from the variance of its mean and what it lacks.
void write_error_layer(Image& image, std::span<const float> variances, std::span<const MissingLight> missing,
                       const Hideable& hideable, const Levels& levels);

/// The brightest channel of the picture.
double brightest(std::span<const float> rgb);

}  // namespace tracer
