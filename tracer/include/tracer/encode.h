#pragma once
/// Encodes an image as the bytes of a file, in memory, and measures what the file loses.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/image.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Difference between the displayed values of a decoded file and of its image: root mean square over pixels and
/// channels, in levels, before rounding, transparent parts over black.
struct EncodingError {
  double image = 0;       ///< over all pixels
  double worst_tile = 0;  ///< over the tile of 16 x 16 pixels (see ErrorEstimate) with the largest difference
};

struct EncodedImage {
  std::vector<std::uint8_t> bytes;  ///< the file
  EncodingError error;
};

/// Formats for display, after exposure, overflow and palette: sRGB (IEC 61966-2-1), clamped to [0,1], rounded to
/// nearest. Others store linear, unclamped radiance. Equal images give equal bytes for any number of threads: no time
/// stamp, no machine name. Runs on the calling thread's oneTBB arena. Fails with a sentence if the encoder does.
///
/// The error is computed from the codes that are written; for lossy formats by decoding the file. That of exr is 0
/// without `half`: its floats are those of the image. Formats of linear radiance are displayed with the exposure and
/// overflow of `output`.
Result<EncodedImage, std::string> encode(const Image& image, Format format, const Output& output = {});

/// Error of a file against the converged image, in levels.
struct FileError {
  double estimate = 0;     ///< see ErrorEstimate::estimate
  double proven = 0;       ///< see ErrorEstimate::proven; infinity: nothing is proven
  double worst_tile = 0;   ///< see ErrorEstimate::worst_tile
  double encoding = 0;     ///< part caused by the file: EncodingError::image
  bool target_met = true;  ///< see ErrorEstimate::target_met
};

/// Combines the error e = n + f of the image, noise and fixed parts, with the difference d between file and image.
///
/// |e + d|^2 = |e|^2 + |d|^2 + 2 <n, d> + 2 <f, d>. Fixed parts (all but `sampling`) may point in the direction of the
/// rounding, so <f, d> is bounded by |f| |d|. Noise does not: rounding errors are uncorrelated with a signal that is
/// spread over the steps (Bennett 1948, "Spectra of quantized signals"; Widrow 1956, "A study of rough amplitude
/// quantization"), and lossy coders remove noise, so that <n, d> is negative. Hence
///   estimate^2 = image^2 + encoding^2 + 2 sqrt(image^2 - sampling^2) encoding.
/// A plain area whose every value is halfway between two codes has correlated noise; `proven` and `worst_tile` hold for
/// it too, since they are sums (triangle inequality).
FileError file_error(const ErrorEstimate& image, const EncodingError& encoding);

}  // namespace tracer
