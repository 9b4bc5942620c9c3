#pragma once
/// Renders a scene at a range of settings, times each image and compares it with a reference.
/// Everything but the times is equal for equal scenes and builds. The tracer reads no clock: the caller passes one in.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracer/compare.h"
#include "tracer/compile.h"
#include "tracer/measurement.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

// ---- reference -----------------------------------------------------------------------------------------------------
// Reference image for measurements, computed independently of the measured settings: independent images of uniform
// samples with other seeds, unfiltered textures, no limits of rays and no approximations; summed in double.

/// Minimum that gives several images of more than the pixel's center, so that their variance can be computed.
inline constexpr std::uint32_t reference_samples_min = 16;

/// Sums over images; one element per pixel and channel.
struct Reference {
  std::uint32_t width = 0, height = 0;
  std::uint32_t image_samples = 0;  ///< per pixel of each image
  std::uint32_t images = 0;
  Accuracy::Model model = Accuracy::Model::whitted;
  bool complete = false;               ///< accurate enough, or all requested samples are taken
  std::vector<double> radiance_sum{};  ///< linear RGB
  std::vector<double> squared_sum{};   ///< squares of linear RGB
};

/// Empty reference of the scene's model for at most `samples` (>= reference_samples_min) per pixel: images of 256
/// samples, or of fewer if that would give less than 8 images.
Reference empty_reference(const Scene& scene, std::uint32_t samples);

/// Scene of the next image, with the model of the reference.
Scene reference_scene(const Scene& scene, const Reference& reference);

/// Adds one image rendered from reference_scene().
void add(Reference& reference, const Image& image);

/// Standard error of the displayed mean, in levels, from the variance of the images: root mean square over pixels and
/// channels. The images are independent, so no model of the scene is needed. The standard deviation of a radiance is
/// mapped to levels as half of the displayed difference between the mean plus and minus one standard deviation.
/// Precondition: at least 2 images.
double standard_error(const Reference& reference, const Output& output);

/// The mean radiance. Precondition: at least 1 image.
Image mean_image(const Reference& reference);

/// The mean radiance after display transform. Precondition: at least 1 image.
DisplayImage to_display(const Reference& reference, const Output& output);

// ---- run -----------------------------------------------------------------------------------------------------------

struct MeasureSettings {
  std::vector<std::string> parameters{};  ///< names of tracer::parameters; empty: all
  /// Maximum samples per pixel of the reference, at least reference_samples_min. Default: well under a minute for
  /// 320 x 240 pixels of glass.
  std::uint32_t reference_samples = 512;
  std::uint32_t threads = 0;        ///< as in RenderSettings
  std::function<double()> seconds;  ///< monotonic clock
};

/// Maximum runs of one setting. A run of some milliseconds is the fastest of several renders.
inline constexpr std::uint32_t timing_runs_max = 6;

struct ModelComparison;

/// A whole measurement in steps, so that the caller can save intermediate results and resume later. The first steps add
/// images to the reference until its standard error is a tenth of the error of the finest setting, or it has all its
/// samples; with the parameter "model" also to a reference of the other model, and one step compares both. The next
/// steps measure one setting each. The last steps are rounds of timings: each runs the settings once more whose order
/// in time relative to their neighbors is uncertain. They end when no order is uncertain, when those settings have
/// `timing_runs_max` runs, or when the repeated runs have taken ten seconds and twice the time of the first ones. If
/// the rendering equation refuses an image file of a scene of Whitted's model, the step leaves out the other models,
/// with the reason in Measurement::not_measured. One thread at a time.
class MeasurementRun {
 public:
  /// Keeps references to `scene` and `assets`. Preconditions: those of `compile`; `settings.seconds` is set.
  MeasurementRun(const Scene& scene, const Assets& assets, MeasureSettings settings);

  ~MeasurementRun();

  /// Continues from the results of an earlier run of the same scene, build and settings. Ignores points of other
  /// settings or without complete references, and a reference of another model, size or number of samples per image.
  void resume(Reference reference);
  void resume(std::vector<MeasuredPoint> points);

  [[nodiscard]] bool done() const;
  /// Title of the next step: "reference, 512 of at most 2048 samples", "cutoff 0.01", "timings of 12 settings".
  /// Precondition: !done().
  [[nodiscard]] std::string next() const;
  [[nodiscard]] std::size_t steps_done() const;
  [[nodiscard]] std::size_t steps() const;  ///< upper bound; the reference and the timings may need fewer
  /// Fails as `compile` and `render` do; then all earlier results remain and the step may be repeated. Precondition:
  /// !done().
  std::optional<Failure> step(RenderControl& control);

  /// The first is that of the scene's model; the second, if there is one, that of the other model. step() may remove
  /// the second.
  [[nodiscard]] const std::vector<Reference>& references() const { return references_; }
  [[nodiscard]] const Reference& reference() const { return references_.front(); }
  [[nodiscard]] Measurement measurement() const;  ///< results so far

 private:
  struct Timed {
    Rendered rendered;
    double seconds = 0;
  };

  /// Images of a reference, computed when they are needed.
  struct ReferenceImages {
    std::optional<DisplayImage> finest;  ///< that of the finest setting of the model, for check_reference()
    std::optional<DisplayImage> mean;    ///< set once the reference is complete
  };

  [[nodiscard]] std::size_t next_reference() const;  ///< index; the number of references if all are complete
  [[nodiscard]] bool needs_comparison() const;
  [[nodiscard]] std::size_t next_setting() const;
  [[nodiscard]] std::size_t reference_of(Accuracy::Model model) const;  ///< index
  /// Scene of a setting. Precondition: the models have been compared if they have to be.
  [[nodiscard]] Scene varied(const Setting& setting) const;
  Result<Timed, Failure> render_timed(const Scene& scene, RenderControl& control) const;
  Result<double, Failure> time_run(const Scene& scene, RenderControl& control) const;
  Result<MeasuredPoint, Failure> measure(const Setting& setting, RenderControl& control);
  const DisplayImage& mean_display(std::size_t reference);
  void add_errors(const DisplayImage& image, MeasuredPoint& point);
  // Preconditions of the next three: all settings have been measured.
  [[nodiscard]] std::vector<std::size_t> settings_to_time() const;  ///< indices, of the next round
  [[nodiscard]] std::size_t rounds_done() const;
  std::optional<Failure> repeat_timings(RenderControl& control);
  std::optional<Failure> compare(RenderControl& control);
  std::optional<Failure> measure_next(RenderControl& control);
  std::optional<Failure> grow_reference(std::size_t index, RenderControl& control);
  std::optional<Failure> check_reference(std::size_t index, RenderControl& control);
  void leave_out_global(const Failure& failure);  ///< keeps the settings of Whitted's model

  const Scene& scene_;
  const Assets& assets_;
  MeasureSettings options_;
  std::vector<Setting> settings_;
  std::vector<std::optional<MeasuredPoint>> points_;  ///< one for each setting
  std::vector<Reference> references_;
  std::vector<ReferenceImages> images_;  ///< one for each reference
  std::unique_ptr<ModelComparison> comparison_;
  std::optional<std::string> refusal_;  ///< set by leave_out_global()
};

}  // namespace tracer
