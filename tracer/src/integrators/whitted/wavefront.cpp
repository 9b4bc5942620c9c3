/// The instantiations of the integrator, each compiled for what its model holds.

#include "tracer/src/integrators/whitted/wavefront.h"

#include "tracer/src/integrators/whitted/bounce_loop.h"
#include "tracer/src/integrators/whitted/direct_lighting.h"
#include "tracer/src/integrators/whitted/normal_mapping.h"
#include "tracer/src/integrators/whitted/secondary_rays.h"
#include "tracer/src/integrators/whitted/shading.h"

namespace tracer {

template class Wavefront<ClassicModel>;
template class Wavefront<FullModel>;

}  // namespace tracer
