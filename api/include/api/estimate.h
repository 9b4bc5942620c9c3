#pragma once
/// What rendering a scene will take, before it is begun.

#include <cstdint>
#include <optional>

#include "tracer/scene.h"

namespace api {

/// Bytes of memory while the scene is compiled, traced and encoded, beyond what an idle worker has. The sum of what was
/// measured of each part (maximum resident size of renders on x86-64, two threads, rounded up): a pixel 40, or 140
/// where sampling adapts, and 30 for each layer of it; a triangle of a mesh 150, any other object 650, the reading of
/// the document included. An instance counts as an object, its prototype once. Files are not known yet and count
/// nothing.
std::uint64_t estimated_memory_bytes(const tracer::Scene& scene);
/// The same while it is measured: its samples adapt then, whatever it asks for, and 150 a pixel more are for sums of
/// the reference and the images that are compared.
std::uint64_t estimated_measure_memory_bytes(const tracer::Scene& scene);

/// How much there is to trace, in rays: times what earlier scenes took for each of theirs it is an order of magnitude
/// (of 24 renders of example scenes two in three were within a factor of three, those of a few milliseconds up to a
/// factor of fifty below). Each pixel counts the samples that its accuracy takes: as many as it is told, or 22 at a
/// target of 1 level and in proportion to the target's power of -1.26, which is what the README's table of presets came
/// to. A sample is a ray, one more for each light that casts shadows (a soft one has 16 points in a pixel at least),
/// all of it half as often again where something mirrors and three times where it refracts. An object and a triangle
/// are a ray's worth of building. Nothing for a time budget without a target.
std::optional<double> estimated_work(const tracer::Scene& scene);

/// Whether it may keep a core busy for more than some seconds: its samples, for a target error those that
/// estimated_work expects and else the most that there may be, are more than 2^21 (1920 x 1080 pixels once), unless a
/// time budget of 2 s ends them; or it is estimated to take more than 256 MiB, to build which takes a second; or it has
/// meshes of files, which may be of any size. What lies between, as mirrors facing each other, no one knows before it
/// is traced.
bool is_large(const tracer::Scene& scene);

}  // namespace api
