#pragma once
/// Cost of accuracy in one scene: the settings to measure, the results, and conclusions from them.
/// Errors are in levels, as in tracer/accuracy.h. Pure functions, any thread.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/plot.h"
#include "tracer/render.h"
#include "tracer/scene.h"

namespace tracer {

// ---- parameters ----------------------------------------------------------------------------------------------------

/// One setting to render the scene with.
struct Setting {
  std::string parameter;  ///< the one of `parameters` that this setting varies
  std::string value;      ///< its value, as a text and a key: "0.5", "shadows: map"; unique per parameter
  Accuracy accuracy;
  std::string preset{};  ///< preset of the same accuracy: "fine"; empty if there is none
  std::string model{};   ///< one of `light_models`; empty if the parameter is another than "model"
};

/// Models of light from other surfaces, values of the parameter "model". whitted: the ambient term of the document.
/// fitted ambient: the ambient light with which Whitted's image is closest to that of the rendering equation. radiosity
/// and gather: Approximations::Interreflection. path: the rendering equation.
inline constexpr std::string_view light_models[] = {"whitted", "fitted ambient", "radiosity", "gather", "path"};

/// Every parameter, in the order of measurement. A setting is the document with nothing else changed. target_error: 8
/// .. 0.25 levels, including the presets. samples: 1 .. 64 per pixel. The next three change one member of the baseline.
/// max_depth: 1 .. 8, and cutoff: 0.1 .. 1e-4, in scenes that reflect or refract. approximate: each cheaper model that
/// changes the scene, and "all exact" if the document has any. model: each of `light_models`, without other
/// approximations, with the samples of the baseline and target errors of 4, 1 and 0.5 levels. document: the accuracy of
/// the scene document, if no setting of another parameter than "model" equals it.
inline constexpr std::string_view parameters[] = {"target_error", "samples", "max_depth", "cutoff",
                                                  "approximate",  "model",   "document"};

/// Samples per pixel of the baseline, which is the document otherwise. Enough to make the effect of a parameter larger
/// than the noise.
inline constexpr std::uint32_t baseline_samples = 16;

/// Settings of the `selected` parameters (empty: all, but "model" only if the scene's model is global), without
/// duplicates, plus the baseline if one of them varies it. Of the models only "whitted" if the rendering equation
/// refuses the scene. Precondition: `scene` passes `validate`, mesh files have been read.
std::vector<Setting> settings(const Scene& scene, std::span<const std::string> selected = {});

/// The first reason why the scene cannot be rendered with Accuracy::Model::global: "/materials/glass gives back 1.02 of
/// the light that it receives ...". Unset if it can. Precondition: that of settings().
std::optional<std::string> refusal_of_global(const Scene& scene);

/// Title for people: "target_error 0.5 (fine)".
std::string title(const Setting& setting);

// ---- results -------------------------------------------------------------------------------------------------------

struct MeasuredPoint {
  Setting setting;
  double seconds = 0;          ///< wall clock of compile() and render(); the fastest run
  std::vector<double> runs{};  ///< seconds of each run, in the order of measurement
  /// Levels; root mean square of the difference from the converged image: the difference from the reference minus the
  /// reference's own error (as variances).
  double error = 0;
  ErrorEstimate claimed{};    ///< error estimate of the render
  double samples_mean = 0;    ///< per pixel, without holdout samples
  std::uint64_t samples = 0;  ///< total, with holdout samples
  RayCounts rays{};           ///< counts of one run
  // With Setting::model, unless the rendering equation refuses the scene:
  /// Levels from the converged image of the model to the rendering equation. radiosity and gather: root of the mean
  /// product of the errors of two renders with different seeds, which sampling does not change in the mean.
  std::optional<double> model_error{};
  std::optional<double> total_error{};  ///< levels; of this image from the rendering equation
  /// Names of the errors that are upper limits: "error", "model_error", "total_error". What the reference (with models:
  /// what both together) shows is not above its own error, which is given instead.
  std::vector<std::string> upper_limits{};
};

/// Returns true if the named error is an upper limit.
bool is_upper_limit(const MeasuredPoint& point, std::string_view error);

/// Mean light of the image, linear RGB, that the rendering equation has more than Whitted's model. The sum is the
/// difference of both images.
struct LightByCause {
  Color interreflection{};  ///< light of `lights` that diffuse surfaces send on
  Color emission{};         ///< light of glowing surfaces that diffuse surfaces send on
  Color environment{};      ///< light of the background that diffuse surfaces send on
  Color ambient{};          ///< <= 0: the ambient term, which the rendering equation has not
};

/// Whitted's converged image, compared with that of the rendering equation. Errors in levels, root mean square.
struct ModelError {
  double levels = 0;
  double standard_error = 0;  ///< that of both references together
  double bias = 0;            ///< mean of Whitted's image minus that of the rendering equation
  LightByCause by{};
  Color fitted_ambient{};  ///< `ambient` of the scene that gives the smallest error; >= 0
  double fitted_levels = 0;
};

struct Measurement {
  std::string name;  ///< scene name
  std::uint32_t width = 0, height = 0;
  std::uint32_t reference_samples = 0;        ///< per pixel of the reference
  double reference_error = 0;                 ///< levels; standard error of the reference
  std::vector<MeasuredPoint> points{};        ///< in the order of `settings`, once all are measured
  std::optional<ModelError> model_error{};    ///< with the parameter "model"
  std::optional<std::string> not_measured{};  ///< why there are no other models, with the parameter "model"
};

/// Returns true if the true error is above the claimed one, by more than the references' own error. A few claims may be
/// broken, since they hold with their confidence.
bool is_broken(const Measurement& measurement, const MeasuredPoint& point);

/// Error of both references together, a limit of what they show of models. 0 without model errors.
double measurable_error(const Measurement& measurement);

/// Indices of the Pareto front of time and claimed error, by rising time and falling claim: each point is faster than
/// all with at most its claim. The claimed error counts, since a user without a reference has no other. Points
/// with broken claims are in no front. Of points with equal times as far as their runs show, that with the smallest
/// claim; of equal claims, the first. Points of the parameter "model" are in no front of claims, nor approximations
/// that are not faster for certain than the exact render that they replace.
std::vector<std::size_t> pareto_front(const Measurement& measurement);

/// Indices of the points of one of `light_models` that no other of them beats in time and total error, fastest first.
/// Without points whose total error is an upper limit.
std::vector<std::size_t> model_front(const Measurement& measurement, std::string_view model);

/// Conclusions in sentences: the cheapest setting that claims at most 4, 1 and 0.5 levels, the broken claims, the
/// settings whose order in time is uncertain, the value beyond which a parameter changes the true error by less than a
/// twentieth, gain and cost of each approximation, the distance of each model from the rendering equation. Upper limits
/// are named as such and compared with nothing. Empty without points.
std::vector<std::string> advice(const Measurement& measurement);

/// Seconds against error, both logarithmic: the true errors of each parameter, the claimed ones beside them, red if
/// broken, and the Pareto front of the claims; for each model the front of its total errors; upper limits have the
/// label
/// "(at most)"; the advice is its note.
Plot chart(const Measurement& measurement);

}  // namespace tracer
