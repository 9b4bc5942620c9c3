// The names of the picture formats; here and not beside the encoders, so that who only names one needs no OpenImageIO.
#include "tracer/encode.h"

namespace tracer {

std::string_view extension(Format format) { return format == Format::png ? "png" : "exr"; }

std::string_view media_type(Format format) { return format == Format::png ? "image/png" : "image/x-exr"; }

}  // namespace tracer
