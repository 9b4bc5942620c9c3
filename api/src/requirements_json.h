#pragma once
/// What a scene requires, as the JSON of reports and of validation.

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "tracer/requirements.h"

namespace api {

nlohmann::ordered_json requirements_json(const tracer::Requirements& needs);

/// For each requirement that holds, a pointer to the first part of the document that needs it.
nlohmann::ordered_json reasons_json(const std::vector<tracer::RequirementReason>& reasons);

}  // namespace api
