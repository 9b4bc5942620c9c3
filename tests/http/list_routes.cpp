/// Prints the routes of both listeners, one a line: METHOD PATTERN QUERY,PARAMETERS. For the test that holds them
/// against the OpenAPI document.

#include <cstdio>

#include "server/http/routes.h"
#include "server/jobs/queue.h"
#include "server/storage/memory/memory_artifact_store.h"
#include "server/storage/memory/memory_asset_store.h"
#include "server/storage/memory/memory_job_store.h"

namespace {

void print(const std::vector<http::Route>& routes) {
  for (const http::Route& route : routes) {
    std::string query;
    for (const std::string& name : route.query) query += (query.empty() ? "" : ",") + name;
    std::printf("%s %s %s\n", route.method.c_str(), route.pattern.c_str(), query.c_str());
  }
}

}  // namespace

int main() {
  jobs::MemoryJobStore store;
  jobs::MemoryArtifactStore artifacts;
  jobs::MemoryAssetStore assets(jobs::system_clock());
  jobs::IdSource ids(jobs::system_clock(), jobs::system_random());
  jobs::Queue queue(store, artifacts, ids, jobs::system_clock(), jobs::no_log(), {});
  jobs::Events events([](const jobs::JobEvent&) { return std::string(); }, jobs::system_clock());
  print(http::client_routes({.jobs = queue,
                             .events = events,
                             .assets = assets,
                             .clock = jobs::system_clock(),
                             .limits = {},
                             .batch_limits = {},
                             .missing_files = {},
                             .sha256 = {},
                             .deliveries = {},
                             .job_memory_bytes = 0,
                             .draining = [] { return false; },
                             .seconds_per_work = {},
                             .told_limits = {}}));
  print(http::health_routes({}));  // whose functions nobody calls here
}
