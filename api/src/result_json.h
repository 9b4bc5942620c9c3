#pragma once
/// JSON members that several documents share: accuracy, error estimate and ray counts.

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "tracer/accuracy.h"
#include "tracer/render.h"

namespace api {

using Json = nlohmann::ordered_json;

inline Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }
/// JSON has no infinity.
inline Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// An object with these members, whose names must differ. Unlike an initializer list of Json it makes no array of each
/// member first, and moves the values.
template <std::size_t count>
Json object_of(std::pair<const char*, Json> (&&members)[count]) {
  Json::object_t object;
  object.reserve(count);
  for (auto& [name, value] : members) object.emplace_back(name, std::move(value));
  return object;
}

/// The accuracy section of a document that has this accuracy. Defaults are omitted.
Json accuracy_json(const tracer::Accuracy& accuracy);

/// {estimate, proven, confidence, target, met, worst_tile, tile_target, bounded, looks, limit,
/// parts{sampling, depth, cutoff, approximation, approximation_min, tone}}. Null: `proven` if nothing is proven,
/// targets that were not requested, `limit` if the number of samples was fixed.
Json error_json(const tracer::ErrorEstimate& error);
/// Its inverse; throws nlohmann::json::exception if a member is missing or has another type.
tracer::ErrorEstimate error_of_json(const Json& json);

/// {camera, shadow, reflection, refraction, diffuse}
Json rays_json(const tracer::RayCounts& rays);
tracer::RayCounts rays_of_json(const Json& json);  ///< throws as error_of_json()

}  // namespace api
