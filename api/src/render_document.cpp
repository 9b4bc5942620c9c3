#include "api/render_document.h"

#include <utility>

#include "api/import_model.h"
#include "tracer/encode.h"

namespace api {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

DocumentRender::Done<Refusal> DocumentRender::parse(std::string_view text, const Limits& limits) {
  Digests digests;
  auto parsed = parse_scene(text, limits, &digests, DigestsOf::scenes_with_patches);
  if (!parsed) return std::move(parsed.error());
  document = *std::move(parsed);
  for (const char* of_the_view : {"camera", "image", "output", "name"}) digests.erase(of_the_view);
  everything_but_the_view.clear();
  for (const auto& [name, sha256] : digests)
    everything_but_the_view.append(name).append(" ").append(sha256).append("\n");
  times.parse = ms_since(start);
  return std::monostate{};
}

DocumentRender::Done<std::vector<tracer::Issue>> DocumentRender::import(const ReadAsset& read, const Limits& limits) {
  if (!document.model) return std::monostate{};
  auto imported = import_model(document, read, limits);
  if (!imported) return std::move(imported.error());
  omitted = std::move(imported->omitted);
  const JobRequest job = std::move(document.job);
  if (auto parsed = parse(imported->text, limits); !parsed) return std::move(parsed.error().issues);
  document.job = job;
  return std::monostate{};
}

DocumentRender::Done<tracer::Failure> DocumentRender::reuse(
    tracer::SceneCache& cache, const std::function<std::string(const std::string&)>& content_of,
    const tracer::RenderControl& control) {
  const auto begin = Clock::now();
  std::vector<std::string> contents;
  for (const tracer::Asset& asset : document.scene.assets) contents.push_back(content_of(asset.name));
  auto entry = cache.acquire(document.scene, std::move(contents), control, everything_but_the_view);
  if (!entry) return std::move(entry.error());
  cache_entry = *std::move(entry);
  times.parse += ms_since(begin);
  return std::monostate{};
}

DocumentRender::Done<std::vector<tracer::Issue>> DocumentRender::load(const ReadAsset& read,
                                                                      const tracer::Limits& limits) {
  const auto begin = Clock::now();
  auto loaded = load_assets(document.scene, read, limits);
  if (!loaded) return std::move(loaded.error());
  assets = *std::move(loaded);
  times.parse += ms_since(begin);
  return std::monostate{};
}

DocumentRender::Done<tracer::Failure> DocumentRender::compile(tracer::RenderControl& control) {
  start = Clock::now();
  const auto entry = std::exchange(cache_entry, nullptr);
  const tracer::Assets files = std::exchange(assets, {});
  auto result =
      tracer::compile_taking_meshes(document.scene, control, files, entry.get(), [this] { return ms_since(start); });
  times.build = ms_since(start);
  if (!result) return std::move(result.error());
  compiled = *std::move(result);
  times.cache_hits = tracer::cache_hits(*compiled);
  times.radiosity = tracer::radiosity_figures(*compiled);
  return std::monostate{};
}

DocumentRender::Done<tracer::Failure> DocumentRender::trace(tracer::RenderSettings settings,
                                                            tracer::RenderControl& control) {
  const auto begin = Clock::now();
  settings.elapsed_ms = [this] { return ms_since(start); };
  auto result = tracer::render(*compiled, settings, control);
  times.trace = ms_since(begin);
  if (!result) return std::move(result.error());
  rendered = *std::move(result);
  memory_bytes = tracer::memory_bytes(*compiled) + rendered.image.rgb.size() * sizeof(float);
  return std::monostate{};
}

tracer::Result<std::vector<std::uint8_t>, std::string> DocumentRender::encode(tracer::Format format, std::string name) {
  const auto begin = Clock::now();
  auto encoded = tracer::encode(rendered.image, format, document.scene.output);
  if (!encoded) return std::move(encoded.error());
  memory_bytes += encoded->bytes.size();
  artifacts.push_back({std::move(name), tracer::file_error(rendered.error, encoded->error), encoded->bytes.size()});
  times.encode += ms_since(begin);
  return std::move(encoded->bytes);
}

std::string DocumentRender::report(const Division& division) const {
  return write_report(document.scene, rendered.error, artifacts, rendered.statistics, times, memory_bytes, division,
                      omitted);
}

}  // namespace api
