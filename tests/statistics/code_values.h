#pragma once
/// Images in code values of the display (0 to 255), the unit of every error. Implements the definition of
/// api/docs/scene.md in double precision and shares no code with the tracer.

#include <vector>

#include "tracer/image.h"
#include "tracer/scene.h"

namespace statistics {

/// Three values a pixel, as in `Image::rgb`.
using CodeValueImage = std::vector<double>;

CodeValueImage image_of(const tracer::Image& image);

/// Factor of the linear values before the curve: the exposure, or 1 / maximum if `overflow` is scale and the maximum
/// exceeds 1.
double gain_of(const CodeValueImage& linear, const tracer::Output& output);

/// One value after gain, overflow, clamping and the sRGB curve (IEC 61966-2-1), times 255, not rounded.
double code_value_of(double linear, double gain, const tracer::Output& output);

/// Code values of a linear image.
CodeValueImage code_values_of(const CodeValueImage& linear, const tracer::Output& output);

}  // namespace statistics
