#pragma once
/// Validation of OpenEXR headers before OpenEXR reads them: the library allocates memory for an attribute of two
/// gigabytes, or for the chunk table of 2^31 rows, declared in a file of four hundred bytes.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/limits.h"

namespace tracer {

/// Empty if everything that the header declares is in the file and within the limits, else an error sentence.
/// Precondition: image_kind(bytes) is openexr. (OpenEXR File Layout, openexr.com: a version, headers of attributes, and
/// for each header a table of eight bytes per chunk.)
std::string exr_header_error(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits);

}  // namespace tracer
