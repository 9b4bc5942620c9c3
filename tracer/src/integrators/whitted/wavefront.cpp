#include "tracer/src/integrators/whitted/wavefront.h"

namespace tracer {

template class Wavefront<WhittedFeatures>;
template class Wavefront<LocalFeatures>;
template class Wavefront<AllFeatures>;

std::unique_ptr<Tracer> make_wavefront(const CompiledScene& scene, const RenderControl& control,
                                       const Approximations& approximations) {
  const auto supported = [&](auto features) {
    return supports<decltype(features)>(scene.needs) && supports<decltype(features)>(scene.exact.needs);
  };
  if (supported(WhittedFeatures{})) return make<Wavefront<WhittedFeatures>>(scene, control, approximations);
  if (supported(LocalFeatures{})) return make<Wavefront<LocalFeatures>>(scene, control, approximations);
  return make<Wavefront<AllFeatures>>(scene, control, approximations);
}

}  // namespace tracer
