#pragma once
/// What the bytes of a picture file say of it before any library reads them.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "tracer/shown.h"

namespace tracer {

/// By the file's first bytes alone; nothing when they are no such file's.
std::optional<PictureKind> picture_kind(std::span<const std::uint8_t> bytes);

/// Why a file of that kind is told to be truncated by its end; empty where it is not, and for kinds whose readers
/// notice it themselves.
std::string what_is_missing(PictureKind kind, std::span<const std::uint8_t> bytes);

/// How many pixels a WebP file says that it has; the library makes room for all of them as it opens it. 0 where it does
/// not say. Precondition: picture_kind(bytes) is webp.
std::uint64_t webp_pixels(std::span<const std::uint8_t> bytes);

}  // namespace tracer
