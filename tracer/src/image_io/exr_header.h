#pragma once
/// What the header of an OpenEXR file claims, before OpenEXR believes it: that makes room for an attribute of two
/// gigabytes, or for the table of an image of 2^31 rows, in a file of four hundred bytes.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/limits.h"

namespace tracer {

/// Empty when all that the header claims is in the file and within the limits; else what is wrong. Precondition:
/// image_kind(bytes) is openexr. (OpenEXR File Layout, openexr.com: a version, headers of attributes, and for each
/// a table of eight bytes for every chunk.)
std::string exr_refusal(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits);

}  // namespace tracer
