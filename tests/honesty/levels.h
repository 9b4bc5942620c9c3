#pragma once
/// Images as a display shows them, in levels of 1/255: the unit of every error. Written from SCENE's definition, in
/// double, and shared with nothing of the tracer.

#include <vector>

#include "tracer/image.h"
#include "tracer/scene.h"

namespace honesty {

/// Three linear values a pixel, as in `Image::rgb`.
using LevelImage = std::vector<double>;

LevelImage image_of(const tracer::Image& image);

/// What the values of `linear` are multiplied by before the curve: the exposure, or where `overflow` is scale and the
/// brightest would pass 1, what makes it 1.
double gain_of(const LevelImage& linear, const tracer::Output& output);

/// One value after gain, overflow, clamping and the sRGB curve (IEC 61966-2-1), times 255, not rounded.
double level_of(double linear, double gain, const tracer::Output& output);

/// Every value so.
LevelImage levels_of(const LevelImage& linear, const tracer::Output& output);

}  // namespace honesty
