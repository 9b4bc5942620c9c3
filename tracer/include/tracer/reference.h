#pragma once
/// Reference image for measurements, computed independently of the measured settings: independent images of uniform
/// samples with other seeds, unfiltered textures, cutoff by chance (unbiased), depth 200, no approximations; summed in
/// double.

#include <cstdint>
#include <vector>

#include "tracer/display_image.h"
#include "tracer/image.h"
#include "tracer/scene.h"

namespace tracer {

/// Minimum that gives several images of more than the pixel's center, so that their variance can be computed.
inline constexpr std::uint32_t reference_samples_min = 16;

/// Sums over images; one element per pixel and channel.
struct Reference {
  std::uint32_t width = 0, height = 0;
  std::uint32_t image_samples = 0;  ///< per pixel of each image
  std::uint32_t images = 0;
  bool complete = false;               ///< accurate enough, or all requested samples are taken
  std::vector<double> radiance_sum{};  ///< linear RGB
  std::vector<double> squared_sum{};   ///< squares of linear RGB
};

/// Empty reference for at most `samples` (>= reference_samples_min) per pixel: images of 256 samples, or of fewer if
/// that would give less than 8 images.
Reference empty_reference(const Scene& scene, std::uint32_t samples);

/// Scene of the next image.
Scene reference_scene(const Scene& scene, const Reference& reference);

/// Adds one image rendered from reference_scene().
void add(Reference& reference, const Image& image);

/// Standard error of the displayed mean, in levels, from the variance of the images: root mean square over pixels and
/// channels. The images are independent, so no model of the scene is needed. The standard deviation of a radiance is
/// mapped to levels as half of the displayed difference between the mean plus and minus one standard deviation.
/// Precondition: at least 2 images.
double standard_error(const Reference& reference, const Output& output);

/// The mean radiance after display transform. Precondition: at least 1 image.
DisplayImage to_display(const Reference& reference, const Output& output);

}  // namespace tracer
