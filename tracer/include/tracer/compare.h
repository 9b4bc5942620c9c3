#pragma once
/// Images after display transform, rendered or read from files, and their comparison: metrics, the worst pixels, a heat
/// map. Differences are in levels: 1/255 of the range from black to white after exposure, clamping and the sRGB curve,
/// one step of an 8-bit image. Pure functions, any thread; equal images give equal metrics.

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tracer/image.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// sRGB codes from 0 to 65535, RGB interleaved, row 0 on top, no padding. Codes of 8-bit and 16-bit files are whole
/// numbers here and therefore exact; those of a rendered image are not rounded.
struct DisplayImage {
  std::uint32_t width = 0, height = 0;
  std::vector<float> codes;
};
inline constexpr double codes_per_level = 257;  // 65535 / 255

/// Applies `output`'s exposure and overflow (not its palette) and composites transparent parts over black. NaN is
/// black.
DisplayImage to_display(const Image& image, const Output& output = {});

struct ImageFile {
  DisplayImage image;
  ImageFormat kind = ImageFormat::png;
};

/// Limits of files to compare. They admit every image that can be rendered, with all its layers.
inline constexpr TextureImageLimits compared_file_limits{
    .pixels = Limits{}.pixels, .channels = 16, .bytes = 16 * sizeof(float) * Limits{}.pixels};

/// Decodes a file of any ImageFormat: codes are taken as sRGB, linear radiance with exposure 0, clamped, sRGB curve
/// applied. Ignores alpha, layers and all images of a file but the first. Fails with a sentence
/// for other formats, truncated or malformed files, and files whose header exceeds `limits`.
Result<ImageFile, std::string> read_image(std::span<const std::uint8_t> bytes,
                                          const TextureImageLimits& limits = compared_file_limits);

/// A PNG of an image that read_image reads, box-filtered in linear light to at most `side` (>= 1) pixels along its
/// longer side, for display. Smaller images keep their size.
Result<std::vector<std::uint8_t>, std::string> thumbnail(std::span<const std::uint8_t> bytes, std::uint32_t side);

/// Difference of one pixel: the maximum of its three channels.
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
  /// Structural similarity, at most 1 (equal images): Wang, Bovik, Sheikh and Simoncelli 2004, "Image Quality
  /// Assessment: From Error Visibility to Structural Similarity", eq. 13-17: Gaussian windows of 11 x 11 pixels with
  /// sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255, mean over the windows that lie within the image. Computed on the luma
  /// 0.2126 R' + 0.7152 G' + 0.0722 B' (ITU-R BT.709), so a change of hue alone does not lower it. Unset for images
  /// smaller than 11 x 11 pixels.
  std::optional<double> ssim{};
  double differing = 0;                  ///< share of the pixels that differ by more than one level
  std::vector<PixelDifference> worst{};  ///< largest differences first; equal ones in image order
};

/// `a` is the reference, if there is one; only `bias` and PixelDifference depend on the order. Lists at most
/// `worst_count` pixels and none without a difference. Fails with a sentence if the sizes differ or there are no
/// pixels.
Result<Comparison, std::string> compare(const DisplayImage& a, const DisplayImage& b, std::size_t worst_count = 5);

/// Scale for heat_map: eight times the root mean square error, rounded up to a power of two, within 1 and 256 levels.
/// Noise then stays dark and outliers are white.
double heat_scale(const Comparison& comparison);

/// Each pixel's difference in the colours of Green 2011 ("A colour scheme for the display of astronomical intensity
/// images", Bulletin of the Astronomical Society of India 39, 289: start 0.5, -1.5 rotations, hue and gamma 1), whose
/// brightness is monotonic: black for 0, white for `white` levels or more. An image whose longer side has more than
/// `side` pixels is reduced to that; a pixel then shows the greatest difference that it covers. Precondition: equal
/// sizes, `white` > 0, `side` >= 1.
Image heat_map(const DisplayImage& a, const DisplayImage& b, double white,
               std::uint32_t side = std::numeric_limits<std::uint32_t>::max());

}  // namespace tracer
