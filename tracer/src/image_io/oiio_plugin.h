#pragma once
/// Functions of the plugin behind oiio_loader.h.

#include "tracer/src/image_io/oiio_loader.h"

namespace tracer {

Encoded oiio_jpeg(const Image& size, Codes codes);
Encoded oiio_webp(const Image& size, Codes codes);
Encoded oiio_exr(const Image& image);
Encoded oiio_hdr(const Image& image);
Decoded oiio_read(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace space,
                  const TextureImageLimits& limits);

}  // namespace tracer
