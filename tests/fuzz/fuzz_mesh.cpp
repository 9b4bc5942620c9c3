/// Arbitrary bytes as a mesh file: must neither crash nor hang, and the result must satisfy the invariants of
/// meshes.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "api/import_model.h"
#include "api/src/gltf/gltf.h"
#include "tests/fuzz/require.h"
#include "tests/support/mesh_files.h"
#include "tracer/mesh_file.h"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name for it
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> bytes(data, data + size);  // of exactly this size: reading beyond its end is seen
  const tracer::Limits limits{.objects = 1000, .triangles = 10'000};
  const auto mesh = api::gltf::is_gltf(bytes) ? api::gltf::read_gltf({.bytes = bytes, .time = 0.5}, limits)
                                              : tracer::read_mesh_file(bytes, limits, size % 2 == 0);
  if (mesh) {
    const std::string broken = mesh_files::broken_promise(*mesh, limits);
    require(broken.empty(), broken.c_str());
  } else {
    require(!mesh.error().empty(), "a refusal has a sentence");
  }
  api::Document model;
  model.model = {"m", 0.5, "{}"};
  api::Limits reading;
  reading.scene = limits;
  reading.files = api::Files::anywhere;
  const auto read = [&](const std::string&) { return api::AssetBytes(bytes); };  // MTL files and images, too
  const auto imported = api::import_model(model, read, reading);
  require(imported || !imported.error().empty(), "a refusal has an issue");
  return 0;
}
