#include "tests/bench/recorded_rays.h"

namespace bench {
namespace {

Recording* recording = nullptr;

template <class Value>
std::vector<Value> copy_of(const Value* values, std::size_t count) {
  return values == nullptr ? std::vector<Value>{} : std::vector<Value>(values, values + count);
}

template <class Value>
const Value* data_of(const std::vector<Value>& values) {
  return values.empty() ? nullptr : values.data();
}

void record(Query::Kind kind, const tracer::RaySpan& rays, tracer::Coherence coherence, tracer::GeometryMask mask) {
  if (recording != nullptr && rays.count != 0) recording->queries.emplace_back(kind, rays, coherence, mask);
}

}  // namespace

Query::Query(Kind query_kind, const tracer::RaySpan& rays, tracer::Coherence ray_coherence,
             tracer::GeometryMask geometry_mask)
    : kind(query_kind),
      coherence(ray_coherence),
      mask(geometry_mask),
      component_{copy_of(rays.ox, rays.count), copy_of(rays.oy, rays.count), copy_of(rays.oz, rays.count),
                 copy_of(rays.dx, rays.count), copy_of(rays.dy, rays.count), copy_of(rays.dz, rays.count)},
      t_max_(copy_of(rays.t_max, rays.count)),
      from_(copy_of(rays.from, rays.count)),
      count_(rays.count) {}

tracer::RaySpan Query::rays() const {
  const auto& [ox, oy, oz, dx, dy, dz] = component_;
  return {ox.data(), oy.data(), oz.data(), dx.data(), dy.data(), dz.data(), data_of(t_max_), data_of(from_), count_};
}

Recording::Recording() { recording = this; }
Recording::~Recording() { recording = nullptr; }

}  // namespace bench

// The linker option --wrap redirects calls of `name` to `__wrap_name`, and calls of `__real_name` to the original. The
// first argument of a member function is its object (Itanium C++ ABI, 2.2).

using tracer::Accelerator;

void real_closest(const Accelerator*, const tracer::RaySpan&, const tracer::HitSpan&, tracer::Coherence, tracer::GeometryMask) __asm__(
    "__real__ZNK6tracer11Accelerator9intersectERKNS_7RaySpanERKNS_7HitSpanENS_9CoherenceENS_12GeometryMaskE");
void real_occluded(const Accelerator*, const tracer::RaySpan&, std::uint8_t*, tracer::Coherence) __asm__(
    "__real__ZNK6tracer11Accelerator8occludedERKNS_7RaySpanEPhNS_9CoherenceE");

void wrapped_closest(const Accelerator*, const tracer::RaySpan&, const tracer::HitSpan&, tracer::Coherence, tracer::GeometryMask) __asm__(
    "__wrap__ZNK6tracer11Accelerator9intersectERKNS_7RaySpanERKNS_7HitSpanENS_9CoherenceENS_12GeometryMaskE");
void wrapped_occluded(const Accelerator*, const tracer::RaySpan&, std::uint8_t*, tracer::Coherence) __asm__(
    "__wrap__ZNK6tracer11Accelerator8occludedERKNS_7RaySpanEPhNS_9CoherenceE");

void wrapped_closest(const Accelerator* self, const tracer::RaySpan& rays, const tracer::HitSpan& hits,
                     tracer::Coherence coherence, tracer::GeometryMask mask) {
  bench::record(bench::Query::Kind::intersect, rays, coherence, mask);
  real_closest(self, rays, hits, coherence, mask);
}

void wrapped_occluded(const Accelerator* self, const tracer::RaySpan& rays, std::uint8_t* occluded,
                      tracer::Coherence coherence) {
  bench::record(bench::Query::Kind::occluded, rays, coherence, tracer::GeometryMask::opaque);
  real_occluded(self, rays, occluded, coherence);
}
