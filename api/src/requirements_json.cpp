#include "api/src/requirements_json.h"

#include <nlohmann/json.hpp>
#include <string>

namespace api {

nlohmann::ordered_json requirements_json(const tracer::Requirements& needs) {
  nlohmann::ordered_json members = nlohmann::ordered_json::object();
  for (const auto& [name, needed] : tracer::requirement_names) members[std::string(name)] = needs.*needed;
  return members;
}

nlohmann::ordered_json reasons_json(const std::vector<tracer::RequirementReason>& reasons) {
  nlohmann::ordered_json members = nlohmann::ordered_json::object();
  for (const auto& [name, needed] : tracer::requirement_names)
    for (const tracer::RequirementReason& reason : reasons)
      if (reason.needed == needed) members[std::string(name)] = reason.pointer;
  return members;
}

}  // namespace api
