#include "api/src/requirements_json.h"

#include <nlohmann/json.hpp>
#include <string>

namespace api {

nlohmann::ordered_json requirements_json(const tracer::Requirements& needs) {
  nlohmann::ordered_json members = nlohmann::ordered_json::object();
  for (const auto& [name, needed] : tracer::requirement_names) members[std::string(name)] = needs.*needed;
  return members;
}

}  // namespace api
