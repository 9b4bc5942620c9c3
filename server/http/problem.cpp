#include "server/http/problem.h"

#include <array>

namespace http {
namespace {

using telemetry::Level;

constexpr std::array rules{
    FailureRule{Failure::bad_request, "bad_request", 400, "The request is not well-formed", Level::info, 0},
    FailureRule{Failure::request_timeout, "request_timeout", 408, "The request came too slowly", Level::info, 0},
    FailureRule{Failure::length_required, "length_required", 411, "The body's length must be given", Level::info, 0},
    FailureRule{Failure::body_too_large, "body_too_large", 413, "The body is too large", Level::info, 0},
    FailureRule{Failure::target_too_long, "target_too_long", 414, "The request target is too long", Level::info, 0},
    FailureRule{Failure::unsupported_encoding, "unsupported_encoding", 415, "Bodies must not be encoded", Level::info,
                0},
    FailureRule{Failure::expectation_failed, "expectation_failed", 417, "The expectation is not known", Level::info, 0},
    FailureRule{Failure::headers_too_large, "headers_too_large", 431, "The headers are too large", Level::info, 0},
    FailureRule{Failure::not_implemented, "not_implemented", 501, "The method is not known", Level::info, 0},
    FailureRule{Failure::version_not_supported, "version_not_supported", 505, "Only HTTP/1.1 and HTTP/1.0 are spoken",
                Level::info, 0},
    FailureRule{Failure::too_many_connections, "too_many_connections", 503, "Too many connections are open",
                Level::warning, 2},
    FailureRule{Failure::overloaded, "overloaded", 503, "Too many requests are waiting", Level::warning, 1},
    FailureRule{Failure::misdirected, "misdirected", 421, "The request is for another host", Level::warning, 0},
    FailureRule{Failure::unauthenticated, "unauthenticated", 401, "A key is needed", Level::warning, 0},
    FailureRule{Failure::forbidden, "forbidden", 403, "The key does not allow this", Level::warning, 0},
    FailureRule{Failure::not_json, "not_json", 400, "The body is not JSON", Level::info, 0},
    FailureRule{Failure::bad_query, "bad_query", 400, "The query is not understood", Level::info, 0},
    FailureRule{Failure::bad_header, "bad_header", 400, "A header is not understood", Level::info, 0},
    FailureRule{Failure::not_found, "not_found", 404, "There is nothing here", Level::info, 0},
    FailureRule{Failure::job_not_found, "job_not_found", 404, "There is no such job", Level::info, 0},
    FailureRule{Failure::image_not_found, "image_not_found", 404, "There is no such image yet", Level::info, 0},
    FailureRule{Failure::asset_not_found, "asset_not_found", 404, "There is no such asset", Level::info, 0},
    FailureRule{Failure::method_not_allowed, "method_not_allowed", 405, "The method is not allowed here", Level::info,
                0},
    FailureRule{Failure::not_acceptable, "not_acceptable", 406, "No accepted format can be given", Level::info, 0},
    FailureRule{Failure::job_running, "job_running", 409, "The job is running", Level::info, 0},
    FailureRule{Failure::job_ended, "job_ended", 409, "The job has ended", Level::info, 0},
    FailureRule{Failure::job_expired, "job_expired", 410, "The job has expired", Level::info, 0},
    FailureRule{Failure::batch_not_found, "batch_not_found", 404, "There is no such batch", Level::info, 0},
    FailureRule{Failure::batch_ended, "batch_ended", 409, "The batch has ended", Level::info, 0},
    FailureRule{Failure::batch_not_failed, "batch_not_failed", 409, "No job of the batch has failed", Level::info, 0},
    FailureRule{Failure::job_not_failed, "job_not_failed", 409, "The job has not failed", Level::info, 0},
    FailureRule{Failure::revision_differs, "revision_differs", 412, "The job has changed", Level::info, 0},
    FailureRule{Failure::revision_required, "revision_required", 428, "If-Match must be given", Level::info, 0},
    FailureRule{Failure::bad_change, "bad_change", 422, "The change cannot be made", Level::info, 0},
    FailureRule{Failure::key_reused, "key_reused", 422, "The Idempotency-Key was used before", Level::info, 0},
    FailureRule{Failure::quota_exceeded, "quota_exceeded", 429, "The quota is used up", Level::info, 60},
    FailureRule{Failure::job_cancelled, "job_cancelled", 409, "The job was cancelled", Level::info, 0},
    FailureRule{Failure::range_not_satisfiable, "range_not_satisfiable", 416, "The range is outside the image",
                Level::info, 0},
    FailureRule{Failure::unsupported_media_type, "unsupported_media_type", 415, "The body must be application/json",
                Level::info, 0},
    FailureRule{Failure::bad_scene, "bad_scene", 422, "The scene cannot be rendered", Level::info, 0},
    FailureRule{Failure::invalid_request, "invalid_request", 422, "The question is not understood", Level::info, 0},
    FailureRule{Failure::asset_mismatch, "asset_mismatch", 422, "The bytes are not those of that name", Level::info, 0},
    FailureRule{Failure::queue_full, "queue_full", 503, "The queue is full", Level::warning, 5},
    FailureRule{Failure::too_many_streams, "too_many_streams", 503, "Too many listen to events", Level::warning, 5},
    FailureRule{Failure::draining, "draining", 503, "The daemon is about to stop", Level::info, 10},
    FailureRule{Failure::store_unavailable, "store_unavailable", 503, "Jobs cannot be stored now", Level::error, 10},
    FailureRule{Failure::disk_full, "disk_full", 503, "The disk is full", Level::error, 30},
    FailureRule{Failure::uploads_full, "uploads_full", 503, "There is no room for another upload", Level::warning, 60},
    FailureRule{Failure::not_ready, "not_ready", 503, "Jobs would not run now", Level::debug, 5},
    FailureRule{Failure::job_failed, "job_failed", 500, "The job failed", Level::warning, 0},
    FailureRule{Failure::internal, "internal", 500, "Something is wrong with the daemon", Level::error, 0},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < rules.size(); ++i) {
    if (static_cast<std::size_t>(rules[i].failure) != i) return false;
  }
  return rules.size() == static_cast<std::size_t>(Failure::internal) + 1;
}
static_assert(in_order(), "one rule per Failure, in its order");

}  // namespace

const FailureRule& rule_of(Failure failure) { return rules[static_cast<std::size_t>(failure)]; }

telemetry::Level level_of(std::optional<Failure> failure, std::string_view method) {
  if (failure) return rule_of(*failure).level;
  return method == "GET" || method == "HEAD" ? Level::debug : Level::info;
}

}  // namespace http
