#include <cstdio>
#include <string>

#include "api/validation_json.h"
#include "tracer/cli/asset_directory_files.h"
#include "tracer/cli/commands.h"
#include "tracer/cli/files.h"
#include "tracer/cli/issues.h"
#include "tracer/requirements.h"

namespace cli {
namespace {

/// What is needed, and the first part of the document that needs it.
void print_requirements(const tracer::Scene& scene) {
  std::vector<tracer::RequirementReason> reasons;
  tracer::requirements(scene, &reasons);
  std::puts("valid; needs:");
  for (const auto& [name, needed] : tracer::requirement_names)
    for (const tracer::RequirementReason& reason : reasons)
      if (reason.needed == needed)
        std::printf("  %-22.*s %s\n", static_cast<int>(name.size()), name.data(), fragment(reason.pointer).c_str());
}

/// The reply of POST /v1/jobs/validate; a document that cannot be read at all is one issue of the whole.
std::string verdict(const tracer::Result<Loaded, api::Refusal>& loaded) {
  if (loaded) return api::write_valid(loaded->document.scene, std::nullopt);
  const api::Refusal& refusal = loaded.error();
  switch (refusal.kind) {
    case api::Refusal::Kind::not_json:
      return api::write_invalid({{"", "not_json",
                                  "line " + std::to_string(refusal.line) + ", column " +
                                      std::to_string(refusal.column) + ": " + refusal.detail}});
    case api::Refusal::Kind::too_large:
      return api::write_invalid({{"", "too_large", refusal.detail}});
    case api::Refusal::Kind::invalid:
      break;
  }
  return api::write_invalid(refusal.issues);
}

}  // namespace

ExitCode check(const Options& options) {
  const auto bytes = read_all(options.scene_path, api::DocumentLimits{}.bytes);
  if (!bytes) {
    std::fprintf(stderr, "whittle: %s\n", bytes.error().sentence.c_str());
    return bad_environment;
  }
  const auto loaded = load(*bytes, options.scene_path, options.uploads_directory);
  if (options.json) {
    std::fputs(verdict(loaded).c_str(), stdout);
  } else if (loaded) {
    print_requirements(loaded->document.scene);
  } else {
    print_issues(stdout, loaded.error());
  }
  if (std::fflush(stdout) != 0) return bad_environment;
  return loaded ? done : bad_scene;
}

}  // namespace cli
