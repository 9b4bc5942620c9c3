#pragma once
/// JSON members that several documents share: requirements, accuracy, error estimate and ray counts.

#include <nlohmann/json.hpp>
#include <optional>

#include "tracer/accuracy.h"
#include "tracer/render.h"
#include "tracer/requirements.h"

namespace api {

using Json = nlohmann::ordered_json;

inline Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

/// {"requirements": {NAME: true|false, ...}, "reasons": {NAME: pointer, ...}}. A reason is the JSON pointer of the
/// first part of the document that has the requirement. Precondition: tracer::validate accepts `scene`.
Json requirements_json(const tracer::Scene& scene);

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
