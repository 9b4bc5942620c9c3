#include "tests/bench/recorded_rays.h"

namespace bench {
namespace {

Recording* recording = nullptr;

template <class Value>
std::vector<Value> copied(const Value* values, std::size_t count) {
  return values == nullptr ? std::vector<Value>{} : std::vector<Value>(values, values + count);
}

template <class Value>
const Value* given(const std::vector<Value>& values) {
  return values.empty() ? nullptr : values.data();
}

void note(Query::Kind kind, const tracer::RaySpan& rays, tracer::Coherence coherence, tracer::GeometryMask mask) {
  if (recording != nullptr && rays.count != 0) recording->queries.emplace_back(kind, rays, coherence, mask);
}

}  // namespace

Query::Query(Kind asked, const tracer::RaySpan& rays, tracer::Coherence neighbours, tracer::GeometryMask seen)
    : kind(asked),
      coherence(neighbours),
      mask(seen),
      component_{copied(rays.ox, rays.count), copied(rays.oy, rays.count), copied(rays.oz, rays.count),
                 copied(rays.dx, rays.count), copied(rays.dy, rays.count), copied(rays.dz, rays.count)},
      t_max_(copied(rays.t_max, rays.count)),
      from_(copied(rays.from, rays.count)),
      count_(rays.count) {}

tracer::RaySpan Query::rays() const {
  const auto& [ox, oy, oz, dx, dy, dz] = component_;
  return {ox.data(), oy.data(), oz.data(), dx.data(), dy.data(), dz.data(), given(t_max_), given(from_), count_};
}

Recording::Recording() { recording = this; }
Recording::~Recording() { recording = nullptr; }

}  // namespace bench

// The linker's --wrap sends calls of a function to the one with __wrap_ before its name, and calls of the one with
// __real_ to the function itself. A member function takes its object first (Itanium C++ ABI, 2.2).

using tracer::Accelerator;

void closest_itself(const Accelerator*, const tracer::RaySpan&, const tracer::HitSpan&, tracer::Coherence, tracer::GeometryMask) __asm__(
    "__real__ZNK6tracer11Accelerator9intersectERKNS_7RaySpanERKNS_7HitSpanENS_9CoherenceENS_12GeometryMaskE");
void occluded_itself(const Accelerator*, const tracer::RaySpan&, std::uint8_t*, tracer::Coherence) __asm__(
    "__real__ZNK6tracer11Accelerator8occludedERKNS_7RaySpanEPhNS_9CoherenceE");

void closest_recorded(const Accelerator*, const tracer::RaySpan&, const tracer::HitSpan&, tracer::Coherence, tracer::GeometryMask) __asm__(
    "__wrap__ZNK6tracer11Accelerator9intersectERKNS_7RaySpanERKNS_7HitSpanENS_9CoherenceENS_12GeometryMaskE");
void occluded_recorded(const Accelerator*, const tracer::RaySpan&, std::uint8_t*, tracer::Coherence) __asm__(
    "__wrap__ZNK6tracer11Accelerator8occludedERKNS_7RaySpanEPhNS_9CoherenceE");

void closest_recorded(const Accelerator* self, const tracer::RaySpan& rays, const tracer::HitSpan& hits,
                      tracer::Coherence coherence, tracer::GeometryMask mask) {
  bench::note(bench::Query::Kind::intersect, rays, coherence, mask);
  closest_itself(self, rays, hits, coherence, mask);
}

void occluded_recorded(const Accelerator* self, const tracer::RaySpan& rays, std::uint8_t* blocked,
                       tracer::Coherence coherence) {
  bench::note(bench::Query::Kind::occluded, rays, coherence, tracer::GeometryMask::opaque);
  occluded_itself(self, rays, blocked, coherence);
}
