#pragma once
/// The image that others are measured by, found by a path of its own: independent images of uniform samples with
/// other seeds, unfiltered textures, a cutoff by chance alone, which is right in the mean, depth 200, no
/// approximations; summed in double.

#include <cstdint>
#include <vector>

#include "tracer/display_image.h"
#include "tracer/image.h"
#include "tracer/scene.h"

namespace tracer {

/// Below that, images would be too few to tell their spread, or of the pixel's centre alone.
inline constexpr std::uint32_t reference_samples_min = 16;

/// Sums over images; one element a pixel and channel.
struct Reference {
  std::uint32_t width = 0, height = 0;
  std::uint32_t image_samples = 0;  ///< in each pixel of each image
  std::uint32_t images = 0;
  bool complete = false;          ///< good enough, or as good as was asked for
  std::vector<double> light{};    ///< linear RGB
  std::vector<double> squares{};  ///< of it
};

/// For at most `samples` in each pixel, of which there are at least reference_samples_min: images of 256, or of
/// fewer where there would be less than 8 of them.
Reference empty_reference(const Scene& scene, std::uint32_t samples);

/// What to render as the next of the images.
Scene reference_scene(const Scene& scene, const Reference& reference);

/// One more image, as rendered of reference_scene.
void add(Reference& reference, const Image& image);

/// Of the mean as a screen shows it, in levels, from the spread of the images: root mean square over pixels and
/// channels. Images of stratified samples are independent of each other, so it needs no model of what they show. A
/// standard deviation of the mean light is told by half of the way on the screen from one below the mean to one above
/// it. Precondition: at least 2 images.
double standard_error(const Reference& reference, const Output& output);

/// The mean of the light, as a screen shows it. Precondition: there are images.
DisplayImage to_display(const Reference& reference, const Output& output);

}  // namespace tracer
