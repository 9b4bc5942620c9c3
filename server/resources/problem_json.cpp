#include "server/resources/problem_json.h"

#include "server/resources/json_values.h"

namespace resources {

std::string write_problem(const ProblemReply& problem) {
  Json json{{"type", problem.type},
            {"title", problem.title},
            {"status", problem.status},
            {"detail", problem.detail},
            {"request_id", problem.request_id}};
  if (!problem.errors.empty()) json["errors"] = errors_json(problem.errors);
  return text_of(json);
}

std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits) {
  Json bounds = Json::object();
  for (const auto& [name, value] : limits) bounds[name] = value;
  return text_of({{"version", version},
                  {"build", build},
                  {"sandbox", sandbox.empty() ? Json(nullptr) : Json(sandbox)},
                  {"limits", std::move(bounds)}});
}

}  // namespace resources
