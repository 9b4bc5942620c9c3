/// Prints the routes of both listeners, one a line: METHOD PATTERN QUERY,PARAMETERS. A test compares them with the
/// OpenAPI document.

#include <atomic>
#include <cstdio>
#include <exception>

#include "server/http/handlers/routes.h"
#include "server/queue/queue.h"
#include "server/storage/files/file_stores.h"
#include "tests/conformance/test_store.h"

namespace {

void print(const std::vector<http::Route>& routes) {
  for (const http::Route& route : routes) {
    std::string query;
    for (const std::string& name : route.rules.query) query += (query.empty() ? "" : ",") + name;
    std::printf("%s %s %s\n", route.method.c_str(), route.pattern.c_str(), query.c_str());
  }
}

}  // namespace

int main() try {
  TemporaryStores temporary;
  storage::files::FileAssetStore assets(temporary.directory.path() + "/uploads", queue::system_clock());
  queue::IdSource ids(queue::system_clock(), queue::system_random());
  queue::Queue queue(temporary.store.all(), temporary.artifacts, ids, queue::system_clock(), queue::no_log(), {});
  queue::Events events([](const queue::JobEvent&) { return std::string(); }, queue::system_clock());
  const telemetry::ServiceHistory history;
  const std::atomic<bool> draining = false;
  http::Readiness readiness([] { return std::string(); }, draining);
  print(http::client_routes({.queue = queue,
                             .events = events,
                             .assets = assets,
                             .deliveries = temporary.store.sqlite().deliveries(),
                             .history = history,
                             .readiness = readiness,
                             .clock = queue::system_clock(),
                             .limits = {},
                             .batch_limits = {},
                             .missing_files = {},
                             .job_memory_bytes = 0,
                             .effective_limits = {}}));
  print(http::health_routes(readiness, {}));  // the functions are not called
} catch (const std::exception& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
