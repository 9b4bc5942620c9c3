/// The instantiations of the integrator, each compiled for what its model holds.

#include "tracer/src/integrator/wavefront.h"

#include "tracer/src/integrator/bending.h"
#include "tracer/src/integrator/branching.h"
#include "tracer/src/integrator/lighting.h"
#include "tracer/src/integrator/shading.h"
#include "tracer/src/integrator/tracing.h"

namespace tracer {

template class Wavefront<ClassicModel>;
template class Wavefront<FullModel>;

}  // namespace tracer
