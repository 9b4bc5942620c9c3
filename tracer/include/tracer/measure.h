#pragma once
/// Renders a scene at a range of settings, times each image and compares it with a reference.
/// Everything but the times is equal for equal scenes and builds. The tracer reads no clock: the caller passes one in.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tracer/assets.h"
#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/measurement.h"
#include "tracer/reference.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

struct MeasureSettings {
  std::vector<std::string> parameters{};  ///< names of tracer::parameters; empty: all
  /// Maximum samples per pixel of the reference, at least reference_samples_min. Default: well under a minute for
  /// 320 x 240 pixels of glass.
  std::uint32_t reference_samples = 512;
  std::uint32_t threads = 0;        ///< as in RenderSettings
  std::function<double()> seconds;  ///< monotonic clock
};

/// A whole measurement in steps, so that the caller can save intermediate results and resume later. The first steps add
/// images to the reference until its standard error is a tenth of the error of the finest setting, or it has all its
/// samples; the next steps measure one setting each. One thread at a time.
class MeasurementRun {
 public:
  /// Keeps references to `scene` and `assets`. Preconditions: those of `compile`; `settings.seconds` is set.
  MeasurementRun(const Scene& scene, const Assets& assets, MeasureSettings settings);

  /// Continues from the results of an earlier run of the same scene, build and settings. Ignores points of other
  /// settings and a reference of another size or number of samples per image.
  void resume(Reference reference);
  void resume(std::vector<MeasuredPoint> points);

  [[nodiscard]] bool done() const;
  /// Title of the next step: "reference, 512 of at most 2048 samples", "cutoff 0.01". Precondition: !done().
  [[nodiscard]] std::string next() const;
  [[nodiscard]] std::size_t steps_done() const;
  [[nodiscard]] std::size_t steps() const;  ///< upper bound; the reference may need fewer
  /// Fails as `compile` and `render` do; then all earlier results remain and the step may be repeated. Precondition:
  /// !done().
  std::optional<Failure> step(RenderControl& control);

  [[nodiscard]] const Reference& reference() const { return reference_; }
  [[nodiscard]] Measurement measurement() const;  ///< results so far

 private:
  struct Timed {
    Rendered rendered;
    double seconds = 0;
  };

  [[nodiscard]] std::size_t next_setting() const;
  Result<Timed, Failure> render_timed(const Scene& scene, RenderControl& control) const;
  Result<MeasuredPoint, Failure> measure(const Setting& setting, RenderControl& control) const;
  std::optional<Failure> grow_reference(RenderControl& control);
  std::optional<Failure> check_reference(RenderControl& control);

  const Scene& scene_;
  const Assets& assets_;
  MeasureSettings options_;
  std::vector<Setting> settings_;
  std::vector<std::optional<MeasuredPoint>> points_;  ///< one for each setting
  Reference reference_;
  std::optional<DisplayImage> finest_;             ///< image of the finest setting, for check_reference()
  std::optional<DisplayImage> reference_display_;  ///< set once the reference is complete
};

}  // namespace tracer
