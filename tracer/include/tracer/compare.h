#pragma once
/// How far two images are apart for the eye that sees them on a screen: figures, the worst pixels, a heat map.
/// Differences are told in **levels**: 1/255 of the range from black to white after exposure, clamping and the sRGB
/// curve, one step of an 8-bit image. Pure functions; any thread; equal images give equal figures.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tracer/display_image.h"
#include "tracer/image.h"
#include "tracer/result.h"

namespace tracer {

/// How far a pixel of one image is from that of the other: the greatest of its three channels' differences.
struct PixelDifference {
  std::uint32_t x = 0, y = 0;
  double difference = 0;      ///< levels
  std::array<double, 3> a{};  ///< levels; RGB
  std::array<double, 3> b{};
};

struct Comparison {
  std::uint32_t width = 0, height = 0;
  double rmse = 0;                       ///< levels; root mean square over all pixels and channels
  std::array<double, 3> rmse_channel{};  ///< levels; RGB
  double bias = 0;                       ///< levels; mean of b - a over all pixels and channels
  double greatest = 0;                   ///< levels; of any channel
  double psnr_db = 0;                    ///< 20 log10(255 / rmse); infinity for equal images
  /// Structural similarity, at most 1, which equal images have: Wang, Bovik, Sheikh and Simoncelli 2004, "Image
  /// Quality Assessment: From Error Visibility to Structural Similarity", eq. 13-17: Gaussian windows of 11 x 11 pixels
  /// with sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255, mean over the windows that lie within the image. Of the luma
  /// 0.2126 R' + 0.7152 G' + 0.0722 B' (ITU-R BT.709) of the codes, so it does not see a change of hue alone. Unset for
  /// images of fewer than 11 x 11 pixels.
  std::optional<double> ssim{};
  double differing = 0;                  ///< share of the pixels that differ by more than one level
  std::vector<PixelDifference> worst{};  ///< those that differ most, falling; of equals, the first in the image first
};

/// `a` is the reference where there is one; only `bias` and the order within `worst` know which is which. At most
/// `worst_count` pixels are listed, none that is the same in both. Fails with a sentence where the sizes differ or
/// there are no pixels.
Result<Comparison, std::string> compare(const DisplayImage& a, const DisplayImage& b, std::size_t worst_count = 5);

/// Eight times the root mean square error, rounded up to a power of two, at least 1 and at most 256 levels: noise then
/// shows as such, and what stands out is white.
double heat_scale(const Comparison& comparison);

/// Each pixel's difference in the colours of Green 2011 ("A colour scheme for the display of astronomical intensity
/// images", Bulletin of the Astronomical Society of India 39, 289: start 0.5, -1.5 rotations, hue and gamma 1), whose
/// brightness rises evenly: black where it is 0, white where it is `white` levels or more. Precondition: equal sizes,
/// `white` > 0.
Image heat_map(const DisplayImage& a, const DisplayImage& b, double white);

}  // namespace tracer
