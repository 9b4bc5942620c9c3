/// POST /v1/measure: what accuracy costs in a scene, as a job.

#include <utility>

#include "api/estimate.h"
#include "api/measure_request.h"
#include "api/report.h"
#include "server/http/handlers/handlers.h"

namespace http {
namespace {

tracer::Result<api::MeasureRequest, Problem> read(const std::string& body, const ApiContext& front) {
  auto parsed = api::parse_measure(body, front.limits);
  if (!parsed) return problem_of(parsed.error());
  const tracer::Scene& scene = parsed->document.scene;
  api::Refusal refusal;
  refusal.issues = refused_here(scene, api::estimated_measure_memory_bytes(scene), front);
  for (tracer::Issue& issue : refusal.issues) issue.pointer.insert(0, "/scene");
  if (!refusal.issues.empty()) return problem_of(refusal);
  return std::move(*parsed);
}

}  // namespace

/// The result cache has nothing to do with it: seconds are of a machine at a time.
Answer measure(Request& request, const ApiContext& front) {
  if (front.draining()) {
    return problem_reply({Failure::draining, "nothing was stored; try again when it is back", {}}, request.id);
  }
  auto body = take_json(request, "a measurement");
  if (!body) return problem_reply(body.error(), request.id);
  auto idempotency = idempotency_of(request, *body, front);
  if (!idempotency) return problem_reply(idempotency.error(), request.id);
  auto wanted = read(*body, front);
  if (!wanted) return problem_reply(wanted.error(), request.id);
  queue::Submission submission;
  submission.kind = queue::JobKind::measure;
  submission.owner = request.owner;
  submission.accuracy = api::write_accuracy(wanted->document.scene.accuracy);
  submission.document = std::move(*body);
  submission.parsed = std::move(wanted->document);
  do_once(submission, std::move(*idempotency), front);
  const auto submitted = front.queue.submission.submit(std::move(submission));
  if (!submitted) return problem_reply(problem_of(submitted.error()), request.id);
  return submission_reply(request, *submitted, front);
}

}  // namespace http
