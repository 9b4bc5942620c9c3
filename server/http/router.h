#pragma once
/// Finds the handler of a request: the only file of ours that speaks to cpp-httplib is its .cpp.
///
/// The library is given a request line that the gate has checked and written anew, never a client's bytes, headers or
/// body; it matches the path, and its own reply goes nowhere. One router belongs to one thread at a time.

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "server/http/pending_request.h"
#include "server/telemetry/json_log.h"

namespace http {

class Router {
 public:
  Router(const std::vector<Route>& routes, const telemetry::Log& log);
  ~Router();

  /// Always an answer: 404 or 405 with Allow where no route fits, a problem where a handler throws.
  Answer answer(Request& request);

  /// Lets a parked request's watch begin. Sets `stop_watching`, or answers the problem that keeps it from beginning.
  std::optional<Reply> start_watch(const DeferredReply& parked, const std::function<void()>& wake,
                                   std::function<void()>& stop_watching, const Request& request);

  /// Answers a parked request, with the same care for exceptions.
  Answer resume(const DeferredReply& parked, bool timed_out, const Request& request);

 private:
  class Library;
  std::unique_ptr<Library> library_;
  telemetry::Log log_;
};

}  // namespace http
