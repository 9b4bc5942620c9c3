#pragma once
/// The body of POST /v1/measure, which is the document of a measuring job.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// Maximum samples per pixel of a reference: for a scene of 320 x 240 pixels, hours on two cores.
inline constexpr std::uint32_t measure_reference_samples_max = 1'000'000;

/// A scene, and the parameters to vary.
struct MeasureRequest {
  Document document;
  std::vector<std::string> parameters;  ///< elements of tracer::parameters, each at most once; empty: all
  std::uint32_t reference_samples = 0;  ///< per pixel; the default is that of tracer::MeasureSettings
};

/// Reads {"scene": document, "settings"?: {"parameters"?: [name, ...], "reference_samples"?: count}}. Refused as by
/// parse_scene, with all issues of the scene and the settings at once; their pointers begin at the body's root
/// ("/scene/camera"). The scene's limit samples_times_pixels also applies to the reference. Time and memory are those
/// of parse_scene. Never throws.
tracer::Result<MeasureRequest, Refusal> parse_measure(std::string_view bytes, const Limits& limits);

}  // namespace api
