#pragma once
/// All failures of requests, with HTTP status, title, log level and Retry-After. They are decided here only; other code
/// names a failure and adds a sentence about the case.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/telemetry/json_log.h"
#include "tracer/validate.h"

namespace http {

struct Failure {
  std::string_view name;  ///< stable; the type of the problem is "urn:whittle:problem:" + name
  int status;
  std::string_view title;  ///< the same for every occurrence (RFC 9457, section 3.1.3)
  telemetry::Level level = telemetry::Level::info;
  int retry_after_s = 0;  ///< 0: no Retry-After
  bool operator==(const Failure&) const = default;
};

/// One occurrence, as the client receives it.
struct Problem {
  Failure failure;
  std::string detail;  ///< one sentence about this case, without internal paths, SQL or stack traces
  std::vector<tracer::Issue> errors = {};
};

/// The level of the log line of a request: that of the failure if there is one, otherwise debug for reads and info for
/// changes.
inline telemetry::Level level_of(const std::optional<Failure>& failure, std::string_view method) {
  if (failure) return failure->level;
  return method == "GET" || method == "HEAD" ? telemetry::Level::debug : telemetry::Level::info;
}

namespace failures {

using telemetry::Level;

// Refused by the server before a handler is called.
inline constexpr Failure bad_request{"bad_request", 400, "The request is not well-formed"};
inline constexpr Failure request_timeout{"request_timeout", 408, "The request came too slowly"};
inline constexpr Failure length_required{"length_required", 411, "The body's length must be given"};
inline constexpr Failure body_too_large{"body_too_large", 413, "The body is too large"};
inline constexpr Failure target_too_long{"target_too_long", 414, "The request target is too long"};
inline constexpr Failure unsupported_encoding{"unsupported_encoding", 415, "Content-Encoding is not supported"};
inline constexpr Failure expectation_failed{"expectation_failed", 417, "The expectation is not supported"};
inline constexpr Failure headers_too_large{"headers_too_large", 431, "The headers are too large"};
inline constexpr Failure not_implemented{"not_implemented", 501, "The method is not supported"};
inline constexpr Failure version_not_supported{"version_not_supported", 505,
                                               "Only HTTP/1.1 and HTTP/1.0 are supported"};
inline constexpr Failure too_many_connections{"too_many_connections", 503, "Too many connections are open",
                                              Level::warning, 2};
inline constexpr Failure overloaded{"overloaded", 503, "Too many requests are waiting", Level::warning, 1};
// Answered by handlers.
inline constexpr Failure misdirected_request{"misdirected_request", 421, "The request is for another host",
                                             Level::warning};
inline constexpr Failure cross_site_request{"cross_site_request", 403, "The request comes from a page of another site",
                                            Level::warning};
inline constexpr Failure unauthenticated{"unauthenticated", 401, "An API key is required", Level::warning};
inline constexpr Failure forbidden{"forbidden", 403, "The API key does not allow this", Level::warning};
inline constexpr Failure not_json{"not_json", 400, "The body is not valid JSON"};
inline constexpr Failure invalid_query{"invalid_query", 400, "The query is invalid"};
inline constexpr Failure invalid_header{"invalid_header", 400, "A header is invalid"};
inline constexpr Failure not_found{"not_found", 404, "There is no such resource"};
inline constexpr Failure job_not_found{"job_not_found", 404, "There is no such job"};
inline constexpr Failure image_not_found{"image_not_found", 404, "There is no such image"};
inline constexpr Failure asset_not_found{"asset_not_found", 404, "There is no such asset"};
inline constexpr Failure method_not_allowed{"method_not_allowed", 405, "The method is not allowed here"};
inline constexpr Failure not_acceptable{"not_acceptable", 406, "No accepted format is available"};
inline constexpr Failure job_running{"job_running", 409, "The job is running"};
inline constexpr Failure job_ended{"job_ended", 409, "The job has ended"};
inline constexpr Failure job_expired{"job_expired", 410, "The job has expired"};
inline constexpr Failure delivery_not_found{"delivery_not_found", 404, "There is no such delivery"};
inline constexpr Failure webhooks_disabled{"webhooks_disabled", 409, "This service sends no webhooks"};
inline constexpr Failure batch_not_found{"batch_not_found", 404, "There is no such batch"};
inline constexpr Failure batch_running{"batch_running", 409, "Jobs of the batch have not ended"};
inline constexpr Failure batch_ended{"batch_ended", 409, "The batch has ended"};
inline constexpr Failure batch_not_failed{"batch_not_failed", 409, "No job of the batch has failed"};
inline constexpr Failure job_not_failed{"job_not_failed", 409, "The job has not failed"};
inline constexpr Failure precondition_failed{"precondition_failed", 412, "The job has changed"};
inline constexpr Failure precondition_required{"precondition_required", 428, "If-Match is required"};
inline constexpr Failure invalid_patch{"invalid_patch", 422, "The change is invalid"};
inline constexpr Failure idempotency_key_reused{"idempotency_key_reused", 422, "The Idempotency-Key was used before"};
inline constexpr Failure quota_exceeded{"quota_exceeded", 429, "The quota is used up", Level::info, 60};
inline constexpr Failure job_cancelled{"job_cancelled", 409, "The job was cancelled"};
inline constexpr Failure range_not_satisfiable{"range_not_satisfiable", 416, "The range is outside the image"};
inline constexpr Failure unsupported_media_type{"unsupported_media_type", 415, "The body must be application/json"};
inline constexpr Failure bad_scene{"bad_scene", 422, "The scene cannot be rendered"};
inline constexpr Failure invalid_request{"invalid_request", 422, "The request is invalid"};
inline constexpr Failure asset_mismatch{"asset_mismatch", 422, "The bytes do not match the name"};
inline constexpr Failure queue_full{"queue_full", 503, "The queue is full", Level::warning, 5};
inline constexpr Failure too_many_streams{"too_many_streams", 503, "Too many event streams are open", Level::warning,
                                          5};
inline constexpr Failure draining{"draining", 503, "The daemon is stopping", Level::info, 10};
inline constexpr Failure store_unavailable{"store_unavailable", 503, "Jobs cannot be stored now", Level::error, 10};
inline constexpr Failure disk_full{"disk_full", 503, "The disk is full", Level::error, 30};
inline constexpr Failure uploads_full{"uploads_full", 503, "The space for uploads is used up", Level::warning, 60};
inline constexpr Failure not_ready{"not_ready", 503, "Jobs cannot run now", Level::debug, 5};
inline constexpr Failure image_damaged{"image_damaged", 500, "The image is damaged", Level::error};
inline constexpr Failure images_differ{"images_differ", 409, "The images differ in size or kind"};
inline constexpr Failure bad_image{"bad_image", 422, "The image cannot be read"};
inline constexpr Failure image_not_processed{"image_not_processed", 503, "The image cannot be processed now",
                                             Level::warning, 2};
inline constexpr Failure job_failed{"job_failed", 500, "The job failed", Level::warning};
inline constexpr Failure internal{"internal", 500, "Internal error of the daemon", Level::error};

}  // namespace failures
}  // namespace http
