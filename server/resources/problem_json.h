#pragma once
/// JSON of problems (RFC 9457) and of the service's version, one line each.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tracer/validate.h"

namespace resources {

/// An empty `errors` is omitted.
struct ProblemReply {
  std::string type, title;
  int status = 500;
  std::string detail, request_id;
  std::vector<tracer::Issue> errors;
};
std::string write_problem(const ProblemReply& problem);

/// {version, build, sandbox, limits{name: value}}; an empty sandbox becomes null.
std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits);

}  // namespace resources
