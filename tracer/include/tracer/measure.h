#pragma once
/// Renders a scene along its parameters, each image timed and compared with a reference.
/// Times are those of the machine at hand; all else is the same for equal scenes and builds. The tracer reads no clock:
/// one is passed in.

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

/// Renders one setting and compares it with a reference of that standard error. `seconds` is any clock that does not go
/// back. Fails as `compile` and `render` do.
Result<MeasuredPoint, Failure> measure(const Scene& scene, const Assets& assets, const Setting& setting,
                                       const DisplayImage& reference, double reference_error,
                                       const std::function<double()>& seconds, std::uint32_t threads,
                                       RenderControl& control);

struct MeasureSettings {
  std::vector<std::string> parameters{};  ///< empty: all
  /// Most samples in each pixel of the reference, at least reference_samples_min. Default: well under a minute
  /// for 320 x 240 pixels of glass.
  std::uint32_t reference_samples = 512;
  std::uint32_t threads = 0;  ///< as RenderSettings has them
  std::function<double()> seconds;
};

/// The whole of it, a step at a time, so that whoever drives it can keep what there is and go on from it later: first
/// the reference grows an image at a time, until its standard error is a tenth of the error of the finest setting or
/// it has all its samples; then each setting is measured. One thread at a time.
class MeasurementRun {
 public:
  /// Keeps references to `scene` and `assets`. Preconditions: those of `compile`; `settings.seconds` is set.
  MeasurementRun(const Scene& scene, const Assets& assets, MeasureSettings settings);

  /// What an earlier run of the same scene, build and settings came to. Points of settings that are none of this run's
  /// are left out; so is a reference of another size or of other parts.
  void resume(Reference reference);
  void resume(std::vector<MeasuredPoint> points);

  [[nodiscard]] bool done() const;
  /// "reference, 512 of at most 2048 samples", "cutoff 0.01". Precondition: !done().
  [[nodiscard]] std::string next() const;
  /// Of steps() at most; the reference may do with fewer.
  [[nodiscard]] std::size_t steps_done() const;
  [[nodiscard]] std::size_t steps() const;
  /// Precondition: !done(). Where it fails nothing is lost that was found before, and it may be tried again.
  std::optional<Failure> step(RenderControl& control);

  [[nodiscard]] const Reference& reference() const { return reference_; }
  /// So far.
  [[nodiscard]] Measurement measurement() const;

 private:
  [[nodiscard]] std::size_t next_setting() const;
  std::optional<Failure> grow_reference(RenderControl& control);
  std::optional<Failure> judge_reference(RenderControl& control);

  const Scene& scene_;
  const Assets& assets_;
  MeasureSettings wanted_;
  std::vector<Setting> settings_;
  std::vector<std::optional<MeasuredPoint>> points_;  ///< one for each setting
  Reference reference_;
  std::optional<DisplayImage> finest_;  ///< the image that the reference must be better than
  std::optional<DisplayImage> shown_;   ///< the reference, once it is complete
};

}  // namespace tracer
