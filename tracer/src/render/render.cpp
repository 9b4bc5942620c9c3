#include "tracer/render.h"

#include <new>

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/adaptive_sampler.h"
#include "tracer/src/sampling/uniform_sampler.h"

namespace tracer {
namespace {

template <Tracer T>
Result<Rendered, Failure> render_with(const CompiledScene& scene, const RenderSettings& settings,
                                      RenderControl& control) {
  try {
    auto rendered = scene.accuracy.adaptive ? AdaptiveSampler<T>(scene, settings, control).run()
                                            : UniformSampler<T>(scene, settings, control).run();
    if (rendered) rendered->statistics.duplicates = scene.geometry().duplicates;
    return rendered;
  } catch (const std::bad_alloc&) {
    return Failure{Failure::Code::out_of_memory, "no memory for the image or its rays"};
  }
}

}  // namespace

Result<Rendered, Failure> render(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  if (supports<WhittedFeatures>(scene.needs)) return render_with<Wavefront<WhittedFeatures>>(scene, settings, control);
  return render_with<Wavefront<AllFeatures>>(scene, settings, control);
}

}  // namespace tracer
