#pragma once
/// What a scene requires, as the JSON of reports and of validation.

#include <nlohmann/json_fwd.hpp>

#include "tracer/requirements.h"

namespace api {

nlohmann::ordered_json requirements_json(const tracer::Requirements& needs);

}  // namespace api
