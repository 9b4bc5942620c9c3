#include "tests/statistics/reference_image.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>

namespace statistics {

using namespace tracer;

namespace {

constexpr double cutoff = 1e-9;
constexpr std::uint32_t max_depth = 2000;
/// Far from the seeds of the images that are compared with the reference.
constexpr std::uint64_t first_seed = 1ull << 40;

struct Sums {
  CodeValueImage sum, squares;
  std::uint64_t images = 0;

  void add(const Image& image) {
    sum.resize(image.rgb.size());
    squares.resize(image.rgb.size());
    for (std::size_t i = 0; i < image.rgb.size(); ++i) {
      const double value = image.rgb[i];
      sum[i] += value;
      squares[i] += value * value;
    }
    ++images;
  }
};

/// FNV-1a (Fowler, Noll, Vo) over an image of the scene with few samples: a scene or a tracer that renders another
/// image has another reference.
std::uint64_t fingerprint(const Case& scene, const ReferenceSettings& settings) {
  const Image image = scenes::render(exact_scene(scene.scene, 16, 1), settings.threads, scene.assets).image;
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto take = [&](std::uint32_t word) { hash = (hash ^ word) * 0x100000001b3u; };
  for (const std::uint32_t word : {settings.samples, max_depth, image.width, image.height}) take(word);
  for (const float value : image.rgb) take(std::bit_cast<std::uint32_t>(value));
  return hash;
}

std::filesystem::path file_of(const Case& scene, const ReferenceSettings& settings,
                              const std::filesystem::path& directory) {
  std::ostringstream name;
  name << scene.name << "-" << std::hex << fingerprint(scene, settings) << ".sums";
  return directory / name.str();
}

/// Returns empty sums if the file is missing or incomplete.
Sums read(const std::filesystem::path& file, std::size_t values) {
  Sums sums{CodeValueImage(values), CodeValueImage(values), 0};
  std::ifstream in(file, std::ios::binary);
  for (CodeValueImage* const part : {&sums.sum, &sums.squares})
    in.read(reinterpret_cast<char*>(part->data()), static_cast<std::streamsize>(values * sizeof(double)));
  in.read(reinterpret_cast<char*>(&sums.images), sizeof sums.images);
  return in ? sums : Sums{};
}

/// Writes a temporary file and renames it: two processes may write at once.
void write(const std::filesystem::path& file, const Sums& sums) {
  std::filesystem::create_directories(file.parent_path());
  const std::filesystem::path draft = file.string() + "." + std::to_string(getpid());
  std::ofstream out(draft, std::ios::binary);
  for (const CodeValueImage* const part : {&sums.sum, &sums.squares})
    out.write(reinterpret_cast<const char*>(part->data()), static_cast<std::streamsize>(part->size() * sizeof(double)));
  out.write(reinterpret_cast<const char*>(&sums.images), sizeof sums.images);
  out.close();
  if (out) std::filesystem::rename(draft, file);
}

ReferenceImage reference_from(const Sums& sums, const Output& output) {
  ReferenceImage reference;
  const auto count = static_cast<double>(sums.images);
  for (const double sum : sums.sum) reference.linear.push_back(sum / count);
  reference.code_values = code_values_of(reference.linear, output);
  const double gain = gain_of(reference.linear, output);
  for (std::size_t i = 0; i < sums.sum.size(); ++i) {
    const double mean = reference.linear[i];
    const double error = std::sqrt(std::max(0.0, sums.squares[i] / count - mean * mean) / (count - 1));
    // Half the distance between a standard error up and one down: right where the curve bends or ends, too.
    const double deviation =
        (code_value_of(mean + error, gain, output) - code_value_of(std::max(0.0, mean - error), gain, output)) / 2;
    reference.variance.push_back(deviation * deviation);
  }
  reference.images = static_cast<std::uint32_t>(sums.images);
  return reference;
}

}  // namespace

double ReferenceImage::error() const {
  return std::sqrt(std::accumulate(variance.begin(), variance.end(), 0.0) / static_cast<double>(variance.size()));
}

Scene exact_scene(const Scene& scene, std::uint32_t samples, std::uint64_t seed) {
  Scene exact = scene;
  exact.accuracy = {};
  exact.accuracy.samples = samples;
  exact.accuracy.max_depth = max_depth;
  exact.accuracy.cutoff = cutoff;
  exact.accuracy.seed = seed;
  for (Texture& texture : exact.textures)
    if (texture.filter == Texture::Filter::mipmap) texture.filter = Texture::Filter::bilinear;
  return exact;
}

ReferenceImage compute_reference(const Case& scene, const ReferenceSettings& settings,
                                 const std::filesystem::path& directory) {
  const std::filesystem::path file = directory.empty() ? directory : file_of(scene, settings, directory);
  Sums sums;
  if (!directory.empty()) sums = read(file, 3 * scene.scene.image.window().pixels());
  const auto done = [&] {
    if (sums.images < settings.images_min) return false;
    return sums.images >= settings.images_max ||
           reference_from(sums, scene.scene.output).error() <= settings.target_error;
  };
  const std::uint64_t stored = sums.images;
  while (!done())
    sums.add(scenes::render(exact_scene(scene.scene, settings.samples, first_seed + sums.images), settings.threads,
                            scene.assets)
                 .image);
  if (!directory.empty() && sums.images > stored) write(file, sums);
  return reference_from(sums, scene.scene.output);
}

}  // namespace statistics
