#pragma once
/// Estimated cost of rendering a scene, before it starts.

#include <cstdint>
#include <optional>

#include "api/measure_request.h"
#include "tracer/scene.h"

namespace api {

/// The facts of a scene that its objects, materials and files determine.
struct SceneContent {
  std::uint64_t memory_bytes = 0;  ///< share of estimated_memory_bytes
  bool mesh_files = false;         ///< there are meshes of files
  bool named_files = false;        ///< there are files that are no uploads, so that the document does not identify them
  double rays_per_sample = 1;      ///< see estimated_work
  std::uint64_t elements = 0;      ///< objects and triangles
};
SceneContent content_of(const tracer::Scene& scene);

/// Bytes of memory for compiling, tracing and encoding, beyond those of an idle worker. The sum of measured parts
/// (maximum resident size of renders on x86-64, two threads, rounded up): a pixel 40, or 90 with adaptive sampling,
/// and 30 for each layer; a triangle of a mesh 150; any other object 650, including the reading of the document. An
/// instance counts as an object, its prototype once. Radiosity takes 320 MiB, or 64 with a target error of 4 levels or
/// more: the most that scenes of a few objects to a million took. A proof takes 8 a pixel and 128 an object or
/// triangle. The contents of files are unknown and count nothing.
std::uint64_t estimated_memory_bytes(const tracer::Scene& scene);
/// The same; `scene` needs no objects, as `content` is that of the complete scene.
std::uint64_t estimated_memory_bytes(const tracer::Scene& scene, const SceneContent& content);
/// The same for a measurement of the scene: its sampling is always adaptive, and each pixel takes 150 bytes more for
/// sums of the reference and for the images that are compared, and as many again for a second reference, whose models
/// include radiosity.
std::uint64_t estimated_measure_memory_bytes(const MeasureRequest& request);

/// Number of rays to trace. Multiplied by the time per ray of earlier scenes it gives the order of magnitude of the
/// time (of 24 renders of example scenes two in three were within a factor of three; those of a few milliseconds took
/// up to 50 times longer). Samples per pixel: the exact number, or 22 at a target error of 1 level and in proportion to
/// the target's power of -1.26, fitted to the README's table of presets. A sample is a ray, and one more for each light
/// that casts shadows (at least 16 per pixel for an area light), all of it times 1.5 with reflection and times 3 with
/// refraction, or 0.3 tracer::predicted_rays() if that is more. Building counts one ray per object and triangle, and
/// each job 20,000 rays: the few milliseconds that the smallest takes. A time budget limits it where the speed is
/// known; otherwise, unset for a time budget without a target.
std::optional<double> estimated_work(const tracer::Scene& scene, const SceneContent& content,
                                     std::optional<double> seconds_per_work = std::nullopt);
std::optional<double> estimated_work(const tracer::Scene& scene);  ///< at an unknown speed
/// Most work of a proof of the image's error, in rays, whether the scene requests it or not: as many samples as the
/// image is expected to have, or 2^14, and the bounds of its pixels, each of which takes as long as about four samples.
/// Unset for a time budget without a target.
std::optional<double> estimated_proof_rays(const tracer::Scene& scene, const SceneContent& content);
/// That of a measurement: twice the work of its reference, for it and the settings; if it compares models, also that of
/// the reference of the other model.
double estimated_measure_work(const MeasureRequest& request);

/// True if the scene may keep a core busy for more than some seconds: if its samples (those that estimated_work
/// expects, else the maximum) are more than 2^21 (1920 x 1080 pixels once) and no time budget of at most 2 s ends them;
/// if it is estimated to take more than 256 MiB, which takes a second to build; or if it has meshes of files, whose
/// size is unknown. Some expensive scenes, such as facing mirrors, cannot be recognised before they are traced.
bool is_large(const tracer::Scene& scene);
bool is_large(const tracer::Scene& scene, const SceneContent& content);  ///< see estimated_memory_bytes

}  // namespace api
