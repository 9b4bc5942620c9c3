#include "tracer/cli/render_summary.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <utility>

namespace cli {
namespace {

/// Rates are over the whole trace time, in which all kinds are traced together.
void print_rays(std::FILE* file, const tracer::RayCounts& rays, double trace_ms) {
  const double seconds = std::max(trace_ms, 1e-3) / 1000;
  const std::array<std::pair<const char*, std::uint64_t>, 5> kinds{{{"camera", rays.camera},
                                                                    {"shadow", rays.shadow},
                                                                    {"reflection", rays.reflection},
                                                                    {"refraction", rays.refraction},
                                                                    {"all", rays.total()}}};
  for (const auto& [kind, count] : kinds) {
    std::fprintf(file, "%-10s %14" PRIu64 " rays %9.2f million/s\n", kind, count,
                 static_cast<double>(count) / seconds / 1e6);
  }
}

/// The error estimate and its parts other than sampling.
void print_error(std::FILE* file, const tracer::ErrorEstimate& error) {
  std::fprintf(file, "error      at most %.3g levels (%.0f %% confidence)", error.estimate, 100 * error.confidence);
  if (error.target) std::fprintf(file, ", target %.3g%s", *error.target, error.target_met ? "" : " not reached");
  const std::array<std::pair<const char*, double>, 3> parts{
      {{"depth", error.depth}, {"cutoff", error.cutoff}, {"approximation", error.approximation}}};
  for (const auto& [part, levels] : parts)
    if (levels >= 5e-4) std::fprintf(file, "; %s %.3g", part, levels);
  std::fputs(error.bounded ? "\n" : "; depth and cutoff are estimates, the radiance of this scene has no bound\n",
             file);
}

}  // namespace

void print_summary(std::FILE* file, const tracer::Rendered& rendered, const RenderSummary& summary) {
  const tracer::RenderStatistics& statistics = rendered.statistics;
  std::fprintf(file, "image      %" PRIu32 " x %" PRIu32 ", %" PRIu64 " samples\n", rendered.image.width,
               rendered.image.height, statistics.samples);
  print_rays(file, statistics.rays, summary.trace_ms);
  print_error(file, rendered.error);
  std::fprintf(file, "time       parse %.1f ms, build %.1f ms, trace %.1f ms, encode %.1f ms\n", summary.parse_ms,
               summary.build_ms, summary.trace_ms, summary.encode_ms);
  if (statistics.culled_shadow_rays != 0) {
    std::fprintf(file, "culled     %" PRIu64 " shadow rays of negligible lights\n", statistics.culled_shadow_rays);
  }
  if (statistics.non_finite != 0) {
    std::fprintf(file, "warning    %" PRIu64 " samples were not finite and are omitted\n", statistics.non_finite);
  }
  for (const RenderSummary::File& written : summary.files) {
    std::fprintf(file, "wrote      %s, %zu bytes\n", written.path.c_str(), written.bytes);
  }
}

}  // namespace cli
