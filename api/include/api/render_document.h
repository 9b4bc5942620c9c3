#pragma once
/// The steps from a document to image files and their report, for the daemon's worker and the command line:
///
///   api::DocumentRender render;
///   auto done = render.parse(text, limits);         // each step returns a value or the reason why it failed
///   auto imported = render.import(read, limits);    // models become scenes
///   auto loaded = render.load(read, limits.scene);
///   auto compiled = render.compile(control);        // then trace()
///   auto png = render.encode(tracer::Format::png, "image.png");
///   std::string report = render.report();
///
/// The steps are called in this order, on one thread. After a failure no further step may be called. Each adds its
/// wall-clock time to `times`, and throws only std::bad_alloc and exceptions of the functions that it is given.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/document.h"
#include "api/load_assets.h"
#include "api/report.h"
#include "tracer/compile.h"
#include "tracer/render.h"
#include "tracer/scene_cache.h"

namespace api {

struct DocumentRender {
  template <class Reason>
  using Done = tracer::Result<std::monostate, Reason>;

  Done<Refusal> parse(std::string_view text, const Limits& limits);

  /// Replaces a document that stands for a model by that of the model, and sets `omitted`; see import_model().
  Done<std::vector<tracer::Issue>> import(const ReadAsset& read, const Limits& limits);

  /// Optional: shares parts of scenes compiled before. `content_of` identifies the content of a file by its name. May
  /// wait; see SceneCache::acquire.
  Done<tracer::Failure> reuse(tracer::SceneCache& cache,
                              const std::function<std::string(const std::string&)>& content_of,
                              const tracer::RenderControl& control);

  /// Loads the files of the scene, as load_assets().
  Done<std::vector<tracer::Issue>> load(const ReadAsset& read, const tracer::Limits& limits);

  /// Moves the meshes out of `document` and frees `assets`. A time budget begins here.
  Done<tracer::Failure> compile(tracer::RenderControl& control);

  /// `settings` without `elapsed_ms`.
  Done<tracer::Failure> trace(tracer::RenderSettings settings, tracer::RenderControl& control);

  /// The bytes of a file, which becomes the artifact `name` of the report; once for each file.
  tracer::Result<std::vector<std::uint8_t>, std::string> encode(tracer::Format format, std::string name);

  [[nodiscard]] std::string report(const Division& division = {}) const;

  Document document;
  std::vector<std::string> omitted;  ///< sentences about parts of the model that the document does not have
  tracer::Assets assets;
  std::shared_ptr<const tracer::CompiledScene> compiled;
  tracer::Rendered rendered;
  StageTimes times;
  std::vector<ReportedArtifact> artifacts;
  std::uint64_t memory_bytes = 0;       ///< size of the compiled scene, the image and the encoded files
  std::string everything_but_the_view;  ///< key for SceneCache::acquire; empty for a scene without patches
  std::shared_ptr<tracer::SceneCacheEntry> cache_entry;  ///< from reuse() until compile() ends
  std::chrono::steady_clock::time_point start =
      std::chrono::steady_clock::now();  ///< start of parsing, then of compiling
};

}  // namespace api
