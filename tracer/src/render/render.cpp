#include "tracer/render.h"

#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "tracer/parts.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/sampling/proof.h"
#include "tracer/src/sampling/sampler.h"

namespace tracer {

Result<Rendered, Failure> render(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  try {
    auto rendered = scene.accuracy.adaptive ? sample_adaptively(scene, settings, control)
                                            : sample_uniformly(scene, settings, control);
    if (rendered) rendered->statistics.duplicates = scene.geometry().duplicates;
    if (rendered && scene.accuracy.proof) prove_error(scene, settings, control, *rendered);
    if (rendered && control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return rendered;
  } catch (const std::bad_alloc&) {
    return Failure{Failure::Code::out_of_memory, "no memory for the image or its rays"};
  }
}

Result<std::string, Failure> trace_part(const CompiledScene& scene, std::string_view part,
                                        const RenderSettings& settings, RenderControl& control) {
  const auto in_parallel = [&](auto count, const auto& work) { for_each_tile(count, settings.threads, work); };
  try {
    auto traced = trace_units(make_wavefront, scene, part, PartSource::untrusted, in_parallel, control);
    if (auto* result = std::get_if<std::string>(&traced)) return std::move(*result);
    if (std::get<UnitOutcome>(traced) == UnitOutcome::cancelled)
      return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return Failure{Failure::Code::internal, "the part does not belong to the scene"};
  } catch (const std::bad_alloc&) {
    return Failure{Failure::Code::out_of_memory, "no memory for a part of the image"};
  }
}

}  // namespace tracer
