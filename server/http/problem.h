#pragma once
/// All failures of requests, with HTTP status, title, log level and Retry-After. They are decided here only; other code
/// names a Failure and adds a sentence about the case.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/telemetry/json_log.h"
#include "tracer/validate.h"

namespace http {

enum class Failure {
  // Refused by the server before a handler is called; most of them close the connection.
  bad_request,
  request_timeout,
  length_required,
  body_too_large,
  target_too_long,
  unsupported_encoding,
  expectation_failed,
  headers_too_large,
  not_implemented,
  version_not_supported,
  too_many_connections,
  overloaded,
  // Answered by handlers.
  misdirected,
  unauthenticated,
  forbidden,
  not_json,
  bad_query,
  bad_header,
  not_found,
  job_not_found,
  image_not_found,
  asset_not_found,
  method_not_allowed,
  not_acceptable,
  job_running,
  job_ended,
  job_expired,
  batch_not_found,
  batch_ended,
  batch_not_failed,
  job_not_failed,
  revision_differs,
  revision_required,
  bad_change,
  key_reused,
  quota_exceeded,
  job_cancelled,
  range_not_satisfiable,
  unsupported_media_type,
  bad_scene,
  invalid_request,
  asset_mismatch,
  queue_full,
  too_many_streams,
  draining,
  store_unavailable,
  disk_full,
  uploads_full,
  not_ready,
  job_failed,
  internal,
};

/// Properties of all problems with one Failure.
struct FailureRule {
  Failure failure;
  std::string_view name;  ///< stable; the problem's type is "urn:whittle:problem:" + name
  int status;
  std::string_view title;  ///< the same for every occurrence (RFC 9457, section 3.1.3)
  telemetry::Level level;
  int retry_after_s;  ///< 0: no Retry-After
};
const FailureRule& rule_of(Failure failure);

/// One occurrence, as the client receives it.
struct Problem {
  Failure failure = Failure::internal;
  std::string detail;  ///< one sentence about this case, without internal paths, SQL or stack traces
  std::vector<tracer::Issue> errors = {};
};

/// The level of the log line of a request: that of the failure if there is one, otherwise debug for reads and info for
/// changes.
telemetry::Level level_of(std::optional<Failure> failure, std::string_view method);

}  // namespace http
