#include "tests/honesty/reference.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>

namespace honesty {

using namespace tracer;

namespace {

constexpr double cutoff = 1e-9;
constexpr std::uint32_t max_depth = 2000;
/// Far from any seed that an image to be judged is rendered with.
constexpr std::uint64_t first_seed = 1ull << 40;

struct Sums {
  LevelImage sum, squares;
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

/// FNV-1a (Fowler, Noll, Vo) over what the scene looks like with a few samples: a scene or a tracer that gives other
/// images has another reference, whoever built it.
std::uint64_t fingerprint(const Case& scene, const ReferenceEffort& effort) {
  const Image look = scenes::render(exact_scene(scene.scene, 16, 1), effort.threads, scene.assets).image;
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto take = [&](std::uint32_t word) { hash = (hash ^ word) * 0x100000001b3u; };
  for (const std::uint32_t word : {effort.samples, max_depth, look.width, look.height}) take(word);
  for (const float value : look.rgb) take(std::bit_cast<std::uint32_t>(value));
  return hash;
}

std::filesystem::path file_of(const Case& scene, const ReferenceEffort& effort,
                              const std::filesystem::path& directory) {
  std::ostringstream name;
  name << scene.name << "-" << std::hex << fingerprint(scene, effort) << ".sums";
  return directory / name.str();
}

/// Nothing where there is no such file or it is not whole: then the work is done again.
Sums read(const std::filesystem::path& file, std::size_t values) {
  Sums sums{LevelImage(values), LevelImage(values), 0};
  std::ifstream in(file, std::ios::binary);
  for (LevelImage* const part : {&sums.sum, &sums.squares})
    in.read(reinterpret_cast<char*>(part->data()), static_cast<std::streamsize>(values * sizeof(double)));
  in.read(reinterpret_cast<char*>(&sums.images), sizeof sums.images);
  return in ? sums : Sums{};
}

/// Under another name first: two runs may be at it.
void write(const std::filesystem::path& file, const Sums& sums) {
  std::filesystem::create_directories(file.parent_path());
  const std::filesystem::path draft = file.string() + "." + std::to_string(getpid());
  std::ofstream out(draft, std::ios::binary);
  for (const LevelImage* const part : {&sums.sum, &sums.squares})
    out.write(reinterpret_cast<const char*>(part->data()), static_cast<std::streamsize>(part->size() * sizeof(double)));
  out.write(reinterpret_cast<const char*>(&sums.images), sizeof sums.images);
  out.close();
  if (out) std::filesystem::rename(draft, file);
}

Reference reference_from(const Sums& sums, const Output& output) {
  Reference reference;
  const auto count = static_cast<double>(sums.images);
  for (const double sum : sums.sum) reference.linear.push_back(sum / count);
  reference.levels = levels_of(reference.linear, output);
  const double gain = gain_of(reference.linear, output);
  for (std::size_t i = 0; i < sums.sum.size(); ++i) {
    const double mean = reference.linear[i];
    const double error = std::sqrt(std::max(0.0, sums.squares[i] / count - mean * mean) / (count - 1));
    // Half the distance between a standard error up and one down: right where the curve bends or ends, too.
    const double levels =
        (level_of(mean + error, gain, output) - level_of(std::max(0.0, mean - error), gain, output)) / 2;
    reference.variance.push_back(levels * levels);
  }
  reference.images = static_cast<std::uint32_t>(sums.images);
  return reference;
}

}  // namespace

double Reference::error() const {
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

Reference reference_of(const Case& scene, const ReferenceEffort& effort, const std::filesystem::path& directory) {
  const std::filesystem::path file = directory.empty() ? directory : file_of(scene, effort, directory);
  Sums sums;
  if (!directory.empty()) sums = read(file, 3 * scene.scene.image.window().pixels());
  const auto done = [&] {
    if (sums.images < effort.images_min) return false;
    return sums.images >= effort.images_max || reference_from(sums, scene.scene.output).error() <= effort.error_wanted;
  };
  const std::uint64_t known = sums.images;
  while (!done())
    sums.add(
        scenes::render(exact_scene(scene.scene, effort.samples, first_seed + sums.images), effort.threads, scene.assets)
            .image);
  if (!directory.empty() && sums.images > known) write(file, sums);
  return reference_from(sums, scene.scene.output);
}

}  // namespace honesty
