#pragma once
/// Random scenes with every shape, light, material, texture and camera, and samples of them that lie outside of their
/// pixels' intervals.

#include <cstdint>
#include <string>

#include "tracer/scene.h"
#include "tracer/src/certify/pixel_bounds.h"

namespace certify {

struct RandomScene {
  tracer::Scene scene;
  tracer::Assets assets;
};

/// The scene of a seed: equal on every machine.
RandomScene random_scene(std::uint64_t seed);

/// Result of comparing samples with intervals.
struct Comparison {
  std::uint64_t samples = 0, outside = 0;
  std::string first;  ///< the first sample outside of its interval
};

/// One interval per pixel of the image's window, row by row; those that a cancelled call left out are empty.
std::vector<tracer::RadianceInterval> intervals_of(const tracer::CompiledScene& scene,
                                                   const tracer::InParallel& in_parallel,
                                                   tracer::RenderControl& control);

/// Traces `per_pixel` random samples of every pixel.
Comparison compare(const tracer::CompiledScene& scene, const std::vector<tracer::RadianceInterval>& intervals,
                   std::uint32_t per_pixel, std::uint64_t seed);

/// Compiles the scene and compares it. Throws std::runtime_error if the scene is not valid.
Comparison compare(const RandomScene& random, std::uint32_t per_pixel, std::uint64_t seed);

/// Calls work for every number in turn.
extern const tracer::InParallel one_by_one;

}  // namespace certify
