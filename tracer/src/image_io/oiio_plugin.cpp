#include "tracer/src/image_io/oiio_plugin.h"

extern "C" __attribute__((visibility("default"))) const tracer::OpenImageIo whittle_open_image_io = {
    .jpeg = tracer::oiio_jpeg,
    .webp = tracer::oiio_webp,
    .exr = tracer::oiio_exr,
    .hdr = tracer::oiio_hdr,
    .read = tracer::oiio_read,
};
