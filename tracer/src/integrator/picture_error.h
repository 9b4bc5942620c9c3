#pragma once
/// From pixels to the error told of their picture.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/accuracy/account.h"
#include "tracer/src/accuracy/uniform_error.h"
#include "tracer/src/integrator/wavefront.h"

namespace tracer {

/// The brightest channel of the picture, where something asks for it: `overflow: scale`, or a scene without a bound of
/// its radiance. 0 elsewhere.
double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb);

/// What a unit of weight that was not traced can hide: the scene's bound of radiance, or without one that of the
/// brightest pixel.
struct Hideable {
  double radiance = 0;
  bool bounded = true;
};
Hideable hideable(const CompiledScene& scene, double brightest_pixel);

/// What pixels are judged by.
struct Judging {
  Levels levels;
  Hideable hideable;
};

/// Adds what a pixel lacks; `rgb` is its mean.
void add(MissingError& sums, const float* rgb, const MissingLight& missing, const Judging& judging);

/// One pixel's in the layer `error`, from the variance of its mean and what it lacks.
float pixel_error(double variance, const float* rgb, const MissingLight& missing, const Judging& judging);

/// A pixel that lacks something; most of most pictures lack nothing.
struct Lack {
  std::uint32_t place;   ///< pictures end at 2^26 pixels
  MissingLight missing;  ///< the mean of its samples'
};

/// What is known of a picture of equal samples; the same for any number of threads. Also writes the layer `error` where
/// `image` has one. `pixels` are those of `image`; `lacks`: by tile, no pixel twice.
struct UniformAccount {
  SampledError sampled;
  MissingError missing;
};
UniformAccount account_for(Image& image, const UniformPixels& pixels, std::span<const std::vector<Lack>> lacks,
                           const Judging& judging, const InParallel& in_parallel);

}  // namespace tracer
