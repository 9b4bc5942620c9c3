#pragma once
/// From radiance to what a display is to show, still linear: exposure, then overflow. The sRGB curve comes after.

#include <vector>

#include "tracer/image.h"
#include "tracer/scene.h"

namespace tracer {

/// The colour without the alpha it is premultiplied by; black where alpha is 0. Three values a pixel, as in
/// `image.rgb`.
std::vector<float> straight_color(const Image& image);

/// Three values a pixel. Values stay finite and non-negative where `linear` is; what clamp leaves above 1 is the
/// encoder's to clamp. For neither exposure nor overflow nothing changes, bit for bit.
void apply_tone(std::vector<float>& linear, const Output& output);

}  // namespace tracer
