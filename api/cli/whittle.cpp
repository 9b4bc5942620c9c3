// whittle: the command line of the tracer. `whittle --help` is its manual.
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <variant>

#include "api/cli/files.h"
#include "api/cli/messages.h"
#include "api/import_model.h"
#include "api/report.h"
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

ExitCode run(const ImportOptions& options) {
  const bool prints = options.output == "-";
  const auto slash = options.output.rfind('/');
  const std::string directory = prints || slash == std::string::npos ? "." : options.output.substr(0, slash + 1);
  SceneSource source = options.model;
  const std::string text = read_document(source, directory);
  source.path = directory + "/-";  // names are relative to the document
  api::DocumentRender render;
  if (auto parsed = render.parse(text, reading_limits()); !parsed) {
    print_issues(stderr, parsed.error());
    return invalid_scene;
  }
  if (!render.document.model) return fail(options.model.path + ": is no model (.glb, .gltf, .obj, .ply, .stl)");
  const auto imported = api::import_model(render.document, asset_reader(source), reading_limits());
  if (!imported) {
    for (const tracer::Issue& issue : imported.error()) print_issue(stderr, issue);
    return invalid_scene;
  }
  print_omitted(stderr, imported->omitted);
  const std::string& document = imported->text;
  if (prints) return run(PrintText{document});
  write_file(options.output, {reinterpret_cast<const std::uint8_t*>(document.data()), document.size()});
  return success;
}

ExitCode run(const CheckOptions& options) {
  api::DocumentRender render;
  const auto loaded = load_scene(render, read_document(options.scene), options.scene);
  if (options.json) {
    const std::string json =
        loaded ? api::write_valid(render.document.scene, std::nullopt) : api::write_invalid(issues_of(loaded.error()));
    std::fputs(json.c_str(), stdout);
  } else if (loaded) {
    print_omitted(stdout, render.omitted);
    print_valid(render.document.scene);
  } else {
    print_issues(stdout, loaded.error());
  }
  if (std::fflush(stdout) != 0) return environment_failure;
  return loaded ? success : invalid_scene;
}

ExitCode run(const PrintText& print) {
  const bool printed = std::fputs(print.text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return printed ? success : environment_failure;  // a full disk, a closed pipe
}

}  // namespace cli

int main(int count, char** arguments) try {
  const auto command = cli::parse_arguments({arguments + (count > 0 ? 1 : 0), arguments + count});
  if (command) return std::visit([](const auto& options) { return cli::run(options); }, *command);
  std::fprintf(stderr, "whittle: %s\nTry: whittle --help\n", command.error().c_str());
  return cli::invalid_usage;
} catch (const std::bad_alloc&) {
  std::fputs("whittle: out of memory\n", stderr);
  return cli::environment_failure;
} catch (const std::exception& failure) {
  std::fprintf(stderr, "whittle: %s\n", failure.what());
  return cli::environment_failure;
}
