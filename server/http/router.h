#pragma once
/// Matches requests to routes.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "server/http/http_messages.h"

namespace http {

/// Processes a request. Called from several threads at once. An exception becomes a problem without details.
using Handler = std::function<Answer(Request&)>;

struct Route {
  std::string method;   ///< GET also serves HEAD
  std::string pattern;  ///< "/v1/jobs/{id}": a name in braces matches one segment of the path
  Handler handler;
  std::vector<std::string> query;  ///< accepted query parameters; requests with others are refused
};

/// Immutable, so thread-safe.
class Router {
 public:
  explicit Router(std::vector<Route> routes) : routes_(std::move(routes)) {}

  /// Calls the handler of the first route that matches and sets Request::route and parameters. If there is none: 404,
  /// or 405 with Allow if another method matches. Throws only what the handler throws.
  Answer answer(Request& request) const;

 private:
  std::vector<Route> routes_;
};

}  // namespace http
