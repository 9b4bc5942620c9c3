#pragma once
/// Tone mapping from radiance to linear display values: exposure, then overflow. The sRGB curve is applied later.

#include <vector>

#include "tracer/image.h"
#include "tracer/scene.h"

namespace tracer {

/// Colors divided by their alpha; black where alpha is 0. Three values per pixel, like `image.rgb`.
std::vector<float> straight_color(const Image& image);

/// Three values per pixel. Values stay finite and non-negative if `linear` is; with overflow clamp the encoder clamps
/// values above 1. Without exposure and overflow the values are bit-identical.
void apply_tone(std::vector<float>& linear, const Output& output);

}  // namespace tracer
