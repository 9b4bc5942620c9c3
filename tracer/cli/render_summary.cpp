#include "tracer/cli/render_summary.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <utility>

namespace cli {
namespace {

/// All kinds are traced in the same stretch of time, so a kind's rate is its part of the whole.
void print_rays(std::FILE* into, const tracer::RayCounts& rays, double trace_ms) {
  const double seconds = std::max(trace_ms, 1e-3) / 1000;
  const std::array<std::pair<const char*, std::uint64_t>, 5> kinds{{{"camera", rays.camera},
                                                                    {"shadow", rays.shadow},
                                                                    {"reflection", rays.reflection},
                                                                    {"refraction", rays.refraction},
                                                                    {"all", rays.total()}}};
  for (const auto& [kind, count] : kinds) {
    std::fprintf(into, "%-10s %14" PRIu64 " rays %9.2f million/s\n", kind, count,
                 static_cast<double>(count) / seconds / 1e6);
  }
}

/// What is left of the error, with the parts that are not of sampling where there are any.
void print_error(std::FILE* into, const tracer::ErrorEstimate& error) {
  std::fprintf(into, "error      at most %.3g levels (%.0f %% sure)", error.estimate, 100 * error.confidence);
  if (error.target) std::fprintf(into, ", %.3g asked for%s", *error.target, error.met ? "" : " and not reached");
  const std::array<std::pair<const char*, double>, 3> parts{
      {{"depth", error.depth}, {"cutoff", error.cutoff}, {"approximation", error.approximation}}};
  for (const auto& [part, levels] : parts)
    if (levels >= 5e-4) std::fprintf(into, "; %s %.3g", part, levels);
  std::fputs(error.bounded ? "\n" : "; depth and cutoff guessed, nothing bounds this scene's light\n", into);
}

}  // namespace

void print_figures(std::FILE* into, const tracer::Rendered& rendered, const Figures& figures) {
  const tracer::RenderStatistics& statistics = rendered.statistics;
  std::fprintf(into, "image    %" PRIu32 " x %" PRIu32 ", %" PRIu64 " samples\n", rendered.image.width,
               rendered.image.height, statistics.samples);
  print_rays(into, statistics.rays, figures.trace_ms);
  print_error(into, rendered.error);
  std::fprintf(into, "time       parse %.1f ms, build %.1f ms, trace %.1f ms, encode %.1f ms\n", figures.parse_ms,
               figures.build_ms, figures.trace_ms, figures.encode_ms);
  if (statistics.culled_shadow_rays != 0) {
    std::fprintf(into, "spared     %" PRIu64 " shadow rays of lights too faint to matter\n",
                 statistics.culled_shadow_rays);
  }
  if (statistics.non_finite != 0) {
    std::fprintf(into, "warning    %" PRIu64 " samples were not finite and are left out\n", statistics.non_finite);
  }
  for (const Figures::File& file : figures.files) {
    std::fprintf(into, "wrote      %s, %zu bytes\n", file.path.c_str(), file.bytes);
  }
}

}  // namespace cli
