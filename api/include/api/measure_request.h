#pragma once
/// Reads the body of POST /v1/measure: a scene, and which of its parameters are to be turned.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// Most samples in each pixel of a reference: of a scene of 320 x 240 pixels hours on two cores.
inline constexpr std::uint32_t measure_reference_samples_max = 1'000'000;

struct MeasureRequest {
  Document document;
  std::vector<std::string> parameters;  ///< of tracer::parameters, none twice; empty: all
  /// tracer::MeasureSettings has the default and its reason.
  std::uint32_t reference_samples = 0;
};

/// {"scene": document, "settings"?: {"parameters"?: [name, ...], "reference_samples"?: count}}. Refused as parse_scene
/// does, with all issues of the scene and the settings at once; their pointers are from the body's root
/// ("/scene/camera"). The scene's limit samples_times_pixels also bounds the reference. Time and memory are
/// parse_scene's. Never throws.
tracer::Result<MeasureRequest, Refusal> parse_measure(std::string_view bytes, const Limits& limits);

}  // namespace api
