// The example scenes of the repository, scaled to the canvas.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "api/document.h"
#include "api/load_assets.h"
#include "tests/statistics/error_coverage/corpus.h"

namespace error_coverage {
namespace {

template <class Bytes>
Bytes read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return Bytes(std::istreambuf_iterator<char>(stream), {});
}

CorpusScene load(const std::filesystem::path& path) {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  auto document = api::parse_scene(read_file<std::string>(path), limits);
  if (!document) throw std::runtime_error(path.string() + " is not a valid scene document");
  const auto read = [&](const std::string& name) -> api::AssetBytes {
    return read_file<std::vector<std::uint8_t>>(path.parent_path() / name);
  };
  auto assets = api::load_assets(document->scene, read, limits.scene);
  if (!assets) throw std::runtime_error(path.string() + ": an asset cannot be read");
  return {.scene = std::move(document->scene), .assets = std::move(*assets)};
}

}  // namespace

std::vector<CorpusEntry> example_entries(const std::string& source_directory) {
  std::vector<CorpusEntry> entries;
  for (const char* name :
       {"whitted", "cornell", "glass", "shapes", "textures", "lights", "transparency", "tone", "lens", "relief", "haze",
        "shading", "instances", "isometric", "mesh_files", "local_models"}) {
    const auto build = [path = std::filesystem::path(source_directory) / "scenes" / (name + std::string(".json"))](
                           Canvas canvas, oracle::Random&) {
      CorpusScene loaded = load(path);
      loaded.scene.image = {canvas.width, canvas.height};
      loaded.scene.accuracy = {};
      loaded.scene.output.formats = {tracer::Format::png};
      loaded.scene.output.palette = 0;
      loaded.scene.output.layers.clear();
      loaded.scene.output.alpha = false;
      return loaded;
    };
    constexpr std::size_t usual = 8;
    entries.push_back({"examples", name, SettingGroup::targets, build, false, entries.size() >= usual});
  }
  return entries;
}

}  // namespace error_coverage
