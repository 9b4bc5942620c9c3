#pragma once
/// JSON members that several documents share: accuracy, error estimate and ray counts.

#include <nlohmann/json.hpp>
#include <optional>

#include "tracer/accuracy.h"
#include "tracer/render.h"

namespace api {

using Json = nlohmann::ordered_json;

inline Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

/// The accuracy section of a document that has this accuracy. Defaults are omitted.
Json accuracy_json(const tracer::Accuracy& accuracy);

/// {estimate, confidence, target, met, bounded, parts{sampling, depth, cutoff, approximation}}
Json error_json(const tracer::ErrorEstimate& error);
/// Its inverse; throws nlohmann::json::exception if a member is missing or has another type.
tracer::ErrorEstimate error_of_json(const Json& json);

/// {camera, shadow, reflection, refraction}
Json rays_json(const tracer::RayCounts& rays);
tracer::RayCounts rays_of_json(const Json& json);  ///< throws as error_of_json()

}  // namespace api
