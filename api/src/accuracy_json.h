#pragma once
/// Writes an accuracy as the document's section that asks for it.

#include <nlohmann/json.hpp>

#include "tracer/accuracy.h"

namespace api {

/// Read again, it gives the same accuracy. Only what is not the default there is named.
nlohmann::ordered_json accuracy_json(const tracer::Accuracy& accuracy);

}  // namespace api
