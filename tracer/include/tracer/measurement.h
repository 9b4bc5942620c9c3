#pragma once
/// What accuracy costs in one scene: the settings worth trying, what they came to, and what that says.
/// Errors are in levels, as in tracer/accuracy.h. Pure functions; any thread.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/plot.h"
#include "tracer/render.h"
#include "tracer/scene.h"

namespace tracer {

// ---- the parameters
// -----------------------------------------------------------------------------------------------------

/// One way to render the scene.
struct Setting {
  std::string parameter;  ///< which of `parameters` is turned
  std::string value;      ///< to what, for people and as a key: "0.5", "shadows: map"; unique for its parameter
  Accuracy accuracy;
  std::string preset{};  ///< the name that documents have for it: "fine"; empty where there is none
};

/// Every parameter, in the order they are turned. target_error: 8 .. 0.25 levels, the presets among them. samples: 1 ..
/// 64, exactly so many in each pixel. The next three change one thing of the baseline. max_depth: 1 .. 8, and cutoff:
/// 0.1
/// .. 1e-4, of scenes that reflect or refract. approximate: each cheaper model that changes something in the scene.
/// document: what the scene itself asks for, where that is none of the others.
inline constexpr std::string_view parameters[] = {"target_error", "samples",     "max_depth",
                                                  "cutoff",       "approximate", "document"};

/// The baseline is exactly so many samples in each pixel, the defaults otherwise: enough for what a parameter costs to
/// be seen beside the noise.
inline constexpr std::uint32_t baseline_samples = 16;

/// Those of `wanted` parameters (all, where it is empty), none twice; with a parameter that starts from the baseline
/// the baseline too. All have the scene's seed. Precondition: `scene` passes `validate`, meshes of files have been
/// read.
std::vector<Setting> settings(const Scene& scene, std::span<const std::string> wanted = {});

/// "target_error 0.5 (fine)"
std::string title(const Setting& setting);

// ---- what is found -------------------------------------------------------------------------------------------------

struct MeasuredPoint {
  Setting setting;
  double seconds = 0;  ///< wall clock of building and tracing; the least of a few runs where that is short
  /// Levels; root mean square of the difference from the converged image: that from the reference without the
  /// reference's own part. 0 where the reference is too coarse to tell.
  double error = 0;
  ErrorEstimate claimed{};    ///< what the render said of itself
  double samples_mean = 0;    ///< in a pixel
  std::uint64_t samples = 0;  ///< in all, those for the estimate included
  RayCounts rays{};           ///< of one run
};

struct Measurement {
  std::string name;  ///< the scene's
  std::uint32_t width = 0, height = 0;
  std::uint32_t reference_samples = 0;  ///< in each pixel of the reference
  double reference_error = 0;           ///< levels; its own standard error
  std::vector<MeasuredPoint> points{};  ///< in the order of `settings`, once all are measured
};

/// Indices of the points that no other beats (at least as accurate in at most the time, and better in one of both), by
/// rising time and so by falling error. Of equal points, the first.
std::vector<std::size_t> pareto_front(std::span<const MeasuredPoint> points);

/// What the numbers say, in sentences: the cheapest setting within 4, 1 and 0.5 levels, which claims did not hold,
/// where a parameter buys nothing any more (less than a twentieth of the error), what each approximation saves and
/// costs. Empty without points.
std::vector<std::string> advice(const Measurement& measurement);

/// Seconds against error, both logarithmic: each parameter's points, the claimed error above or below the true one, and
/// the front; the advice is its note.
Plot chart(const Measurement& measurement);

}  // namespace tracer
