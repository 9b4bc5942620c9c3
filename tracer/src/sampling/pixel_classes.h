#pragma once
/// Classes of pixels. All pixels of a class get equally many samples, and share what these show of their variance: the
/// samples of a pixel alone are too few to decide about it, and would bias its mean if they did.
///
/// A pixel is mixed if its pilot has another signature (integrators/sample_signature.h) than that of one of its eight
/// neighbors: an edge crosses it or passes close by. Mixed pixels are sorted by the number of such neighbors and by the
/// contrast to them, all others by the curvature of the image around them.

#include <array>
#include <cstdint>
#include <span>

#include "tracer/scene.h"
#include "tracer/src/integrators/sample_signature.h"

namespace tracer {

enum class PixelKind : std::uint8_t {
  corner,
  one_side,
  two_sides,
  more_sides,   ///< mixed, by the number of sides with another signature
  mirrored,     ///< the first of the same four where pilots show something in mirrors or through glass
  feature = 8,  ///< mixed as well: something thin was projected here, which the pilot may have missed
  grown,        ///< mixed as well: close to a find
  smooth,
  reflecting,  ///< smooth, and samples may show anything: in mirrors, through glass, or of a filtered texture
};
inline constexpr std::size_t kind_count = 12;

/// kind * contrast_bins + bin; a bin is an octave of squared code values. The bins of grown pixels are rounds.
using PixelClass = std::uint8_t;
inline constexpr std::size_t contrast_bins = 18, class_count = kind_count * contrast_bins;
inline PixelKind pixel_kind(std::size_t pixel_class) { return static_cast<PixelKind>(pixel_class / contrast_bins); }
inline bool is_mixed(std::size_t pixel_class) { return pixel_kind(pixel_class) < PixelKind::smooth; }

inline bool is_grown(std::size_t pixel_class) { return pixel_kind(pixel_class) == PixelKind::grown; }
inline PixelClass grown_class(std::uint32_t round) {
  return static_cast<PixelClass>(static_cast<std::size_t>(PixelKind::grown) * contrast_bins + round);
}

template <class Value>
using ByClass = std::array<Value, class_count>;

/// Sums over the pixels of a class.
struct ClassCount {
  double pixels = 0;
  double curvature = 0;  ///< expected squared error of smooth pilots, in squared code values, summed over the channels
  double slope = 0;      ///< expected variance of one sample of smooth pixels, likewise
  double rays = 0;       ///< those of the pilots
  double missed = 0;     ///< squared error of pilots that missed their features, likewise
  void add(const ClassCount& other) {
    missed += other.missed;
    pixels += other.pixels;
    curvature += other.curvature;
    slope += other.slope;
    rays += other.rays;
  }
};

/// The pilots of an image, row by row. References must outlive it.
struct PilotImage {
  std::uint32_t width = 0, height = 0;
  std::array<std::span<const float>, 3> code_values;  ///< by channel
  std::span<const SampleSignature> signatures;
  std::span<const float> features;  ///< see PixelFeatures::squared; empty: there are none
  bool noisy = false;               ///< the samples of a pixel differ by chance
};

/// Sets the classes of the pixels of `window`, in columns and rows of the image, and returns their counts.
///
/// The error of a smooth pilot is that of its center: a quadratic part a x^2 of the radiance has the mean a / 12 over
/// the pixel and the second difference 2 a, so that 1/24 of the Laplacian remains. A
/// difference d of neighbors gives the samples of a pixel the variance d^2 / 12. The neighbors of a noisy pilot show
/// the noise: their mean squared difference is its variance and the pilot's own squared error.
ByClass<ClassCount> classify(const PilotImage& pilots, const PixelWindow& window, std::span<PixelClass> classes);

}  // namespace tracer
