#include "api/job_patch.h"

#include "api/src/reader/fields.h"
#include "api/src/reader/request.h"
#include "api/src/reader/sections.h"

namespace api {

tracer::Result<RequestedChange, Refusal> parse_change(std::string_view bytes, const Limits& limits) {
  return read_request<RequestedChange>(bytes, limits.document, [&](json::Tape& tape, RequestedChange& change) {
    Reading reading(tape, limits);
    Fields fields(reading, reading.root, "a change of a job");
    fields.optional("priority", Integer<std::optional<int>>{change.priority, 0, 100});
    if (std::string name; fields.optional("name", Name{name})) change.name = name;
    if (const auto labels = fields.take("labels")) read_labels(reading, *labels, true, change.labels);
    if (const auto expires_at = fields.take("expires_at")) {
      std::optional<std::int64_t> time;
      const bool never = expires_at->node->kind == json::Kind::null;
      if (never || read(reading, *expires_at, Time{time})) change.expires_at = time;
    }
    fields.finish();
    return reading.take_issues();
  });
}

}  // namespace api
