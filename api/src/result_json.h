#pragma once
/// JSON members that several documents share: accuracy, error estimate and ray counts.

#include <cmath>

#include "api/json.h"
#include "tracer/accuracy.h"
#include "tracer/render.h"

namespace api {

/// JSON has no infinity.
inline Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// The accuracy section of a document that has this accuracy. Defaults are omitted.
Json accuracy_json(const tracer::Accuracy& accuracy);

/// The member `error` of the schema Report.
Json error_json(const tracer::ErrorEstimate& error);
/// Its inverse; throws nlohmann::json::exception if a member is missing or has another type.
tracer::ErrorEstimate error_of_json(const Json& json);

/// {camera, shadow, reflection, refraction, diffuse}
Json rays_json(const tracer::RayCounts& rays);
tracer::RayCounts rays_of_json(const Json& json);  ///< throws as error_of_json()

}  // namespace api
