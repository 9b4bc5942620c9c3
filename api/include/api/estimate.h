#pragma once
/// What rendering a scene will take, before it is begun.

#include <cstdint>

#include "tracer/scene.h"

namespace api {

/// Bytes of memory while the scene is compiled, traced and encoded, beyond what an idle worker has. The sum of what was
/// measured of each part (maximum resident size of renders on x86-64, two threads, rounded up): a pixel 40, or 140
/// where sampling adapts, and 30 for each layer of it; a triangle of a mesh 150, any other object 650, the reading of
/// the document included. An instance counts as an object, its prototype once. Files are not known yet and count
/// nothing.
std::uint64_t estimated_memory_bytes(const tracer::Scene& scene);
/// The same while it is measured: its samples adapt then, whatever it asks for, and 150 a pixel more are for sums of
/// the reference and the pictures that are compared.
std::uint64_t estimated_measure_memory_bytes(const tracer::Scene& scene);

}  // namespace api
