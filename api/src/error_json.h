#pragma once
/// What a render told of itself, as JSON members that several documents have.

#include <nlohmann/json.hpp>

#include "tracer/accuracy.h"
#include "tracer/render.h"

namespace api {

/// {estimate, confidence, target, met, bounded, parts{sampling, depth, cutoff, approximation}}
nlohmann::ordered_json error_json(const tracer::ErrorEstimate& error);
/// The same way back; throws nlohmann::json::exception where something is missing or of another type.
tracer::ErrorEstimate error_of_json(const nlohmann::ordered_json& json);

/// {camera, shadow, reflection, refraction}
nlohmann::ordered_json rays_json(const tracer::RayCounts& rays);
tracer::RayCounts rays_of_json(const nlohmann::ordered_json& json);

}  // namespace api
