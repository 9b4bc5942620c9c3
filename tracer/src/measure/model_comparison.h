#pragma once
/// Distance of Whitted's model from the rendering equation: by cause, and with the ambient light that makes it
/// smallest.

#include <functional>

#include "tracer/compare.h"
#include "tracer/image.h"
#include "tracer/measure.h"
#include "tracer/measurement.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Levels by which the converged image that `image` shows with an independent error of `image_error` differs from that
/// of `reference`. Independent errors add up as squares; both are subtracted. 0 if they are larger than the difference.
/// Precondition: equal sizes.
double distance(const DisplayImage& reference, double reference_error, const DisplayImage& image,
                double image_error = 0);

/// The same for the part that both images have in common: the mean product of their differences, without noise if they
/// are independent.
double common_distance(const DisplayImage& reference, double reference_error, const DisplayImage& one,
                       const DisplayImage& other);

struct ModelComparison {
  ModelError error;
  DisplayImage fitted;  ///< Whitted's converged image with the fitted ambient light
};

/// Renders a scene as it is, including its accuracy.
using RenderImage = std::function<Result<Image, Failure>(const Scene&)>;

/// Compares two complete references of the scene. Light is additive: each cause is the difference of two images that
/// have no other source of light, or, if there is only one source, that of the references. The ambient term is a third
/// image, which the fit scales. Fails as `render` does.
Result<ModelComparison, Failure> compare_models(const Scene& scene, const Reference& whitted, const Reference& global,
                                                const RenderImage& render);

}  // namespace tracer
