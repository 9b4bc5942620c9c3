#include <cstdio>
#include <string>
#include <vector>

#include "api/report.h"
#include "tracer/cli/files.h"
#include "tracer/cli/messages.h"
#include "tracer/requirements.h"

namespace cli {
namespace {

/// Each requirement with the first part of the document that needs it, the light of the global model, then warnings.
void print_valid(const tracer::Scene& scene) {
  std::vector<tracer::RequirementReason> reasons;
  tracer::requirements(scene, &reasons);
  std::puts("valid; requires:");
  for (const auto& [name, needed] : tracer::requirement_names)
    for (const tracer::RequirementReason& reason : reasons)
      if (reason.needed == needed)
        std::printf("  %-22.*s %s\n", static_cast<int>(name.size()), name.data(),
                    api::uri_fragment(reason.pointer).c_str());
  std::printf("global light %s\n", tracer::global_light_summary(scene).c_str());
  print_warnings(stdout, scene);
}

}  // namespace

ExitCode run(const CheckOptions& options) {
  const auto text = read_document(options.scene);
  if (!text) return fail(text.error().message);
  const auto loaded = load_scene(*text, options.scene);
  if (options.json) {
    const std::string json =
        loaded ? api::write_valid(loaded->document.scene, std::nullopt) : api::write_invalid(issues_of(loaded.error()));
    std::fputs(json.c_str(), stdout);
  } else if (loaded) {
    print_valid(loaded->document.scene);
  } else {
    print_issues(stdout, loaded.error());
  }
  if (std::fflush(stdout) != 0) return environment_failure;
  return loaded ? success : invalid_scene;
}

}  // namespace cli
