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

/// Whether it may keep a core busy for more than some seconds: its samples, where they adapt the most that there may
/// be, are more than 2^21 (1920 x 1080 pixels once), unless a time budget of 2 s ends them; or it is estimated to take
/// more than 256 MiB, to build which takes a second; or it has meshes of files, which may be of any size. What lies
/// between, as mirrors facing each other, no one knows before it is traced.
bool is_large(const tracer::Scene& scene);

}  // namespace api
