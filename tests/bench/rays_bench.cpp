/// Rays per second of a scene, one thread: the whole tracer (rays made, traced, shaded, summed), its accelerator alone,
/// and bare Embree, all on exactly the same rays, which are recorded while the tracer traces the image: camera's,
/// reflected, refracted and shadow rays. Bare Embree has them once with the flags of coherence that the tracer gives
/// and once all as coherent: what takes less counts. Seconds are the processor's, so that the machine may do other work
/// beside; ratios are taken within one run, round by round.
///
///     rays_bench scenes/sphereflake.json [width height rounds [depth]]
///
/// The depth is the document's where none is given. Takes about 300 bytes a ray.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/document.h"
#include "api/load_assets.h"
#include "tests/bench/bare_embree.h"
#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace {

using bench::Query;

template <class Work>
double seconds_of(const Work& work) {
  const double start = bench::processor_seconds();
  work();
  return bench::processor_seconds() - start;
}

std::size_t count_rays(const std::vector<Query>& queries, Query::Kind kind) {
  std::size_t count = 0;
  for (const Query& query : queries) {
    const tracer::RaySpan rays = query.rays();
    for (std::size_t i = 0; query.kind == kind && i < rays.count; ++i) count += Query::is_ray(rays, i) ? 1 : 0;
  }
  return count;
}

/// The accelerator's answers to queries, one after the other.
class Answers {
 public:
  explicit Answers(const std::vector<Query>& queries) : queries_(queries) {
    std::size_t most = 0;
    for (const Query& query : queries) most = std::max(most, query.rays().count);
    primitive_.resize(most);
    t_.resize(most);
    u_.resize(most);
    v_.resize(most);
    blocked_.resize(most);
  }
  void ask(const tracer::Accelerator& accelerator, Query::Kind kind) {
    for (const Query& query : queries_) {
      if (query.kind != kind) continue;
      if (kind == Query::Kind::occluded) {
        accelerator.occluded(query.rays(), blocked_.data(), query.coherence);
      } else {
        accelerator.intersect(query.rays(), {primitive_.data(), t_.data(), u_.data(), v_.data()}, query.coherence,
                              query.mask);
      }
    }
  }

 private:
  const std::vector<Query>& queries_;
  std::vector<tracer::PrimitiveRef> primitive_;
  std::vector<double> t_, u_, v_;
  std::vector<std::uint8_t> blocked_;
};

template <class Bytes>
Bytes content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(stream), {});
}

struct Loaded {
  api::Document document;
  tracer::Assets assets;
};

std::optional<Loaded> load(const std::filesystem::path& path) {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  auto document = api::parse_scene(content_of<std::string>(path), limits);
  if (!document) return std::nullopt;
  const auto read = [&](const std::string& name) -> api::AssetBytes {
    return content_of<std::vector<std::uint8_t>>(path.parent_path() / name);
  };
  auto assets = api::load_assets(document->scene, read, limits.scene);
  if (!assets) return std::nullopt;
  return Loaded{std::move(*document), std::move(*assets)};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void print(const char* what, std::size_t rays, const std::vector<double>& seconds, const std::vector<double>& bare) {
  std::vector<double> ratio;
  for (std::size_t i = 0; i < seconds.size(); ++i) ratio.push_back(seconds[i] / bare[i]);
  std::printf("%-34s %9zu rays %8.1f M/s   time / bare Embree %5.2f\n", what, rays,
              static_cast<double>(rays) / median(seconds) / 1e6, median(ratio));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: rays_bench scene.json [width height rounds]\n");
    return 2;
  }
  std::optional<Loaded> loaded = load(argv[1]);
  if (!loaded) {
    std::fprintf(stderr, "%s: not a scene; `whittle check` tells why\n", argv[1]);
    return 1;
  }
  tracer::Scene& scene = loaded->document.scene;
  scene.image.width = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[2])) : 1920;
  scene.image.height = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[3])) : 1080;
  scene.accuracy.samples = 1;
  const int rounds = argc > 4 ? std::atoi(argv[4]) : 7;
  if (argc > 5) scene.accuracy.max_depth = static_cast<std::uint32_t>(std::atoi(argv[5]));

  tracer::RenderControl control;
  auto compiled = tracer::compile_taking_meshes(scene, control, loaded->assets);
  if (!compiled) return 1;
  std::vector<Query> queries;
  bool rendered = false;
  {
    bench::Recording recording;
    rendered = static_cast<bool>(tracer::render(**compiled, {.threads = 1}, control));
    queries = std::move(recording.queries);
  }
  const bench::BareEmbree bare((*compiled)->geometry());
  Answers answers(queries);

  // In each round one after the other, so that all suffer alike from what the machine does beside.
  constexpr Query::Kind kinds[] = {Query::Kind::intersect, Query::Kind::occluded};
  std::vector<double> whole, own[2], bare_alone[2], bare_both;
  for (int round = 0; round < rounds; ++round) {
    for (int kind = 0; kind < 2; ++kind) {
      bare_alone[kind].push_back(
          std::min(bare.trace(queries, kinds[kind], bench::BareEmbree::Flags::as_asked).seconds,
                   bare.trace(queries, kinds[kind], bench::BareEmbree::Flags::coherent).seconds));
      own[kind].push_back(seconds_of([&] { answers.ask(*(*compiled)->accelerator, kinds[kind]); }));
    }
    bare_both.push_back(bare_alone[0].back() + bare_alone[1].back());
    whole.push_back(seconds_of([&] { rendered = rendered && tracer::render(**compiled, {.threads = 1}, control); }));
  }
  if (!rendered) return 1;
  std::printf("%s %ux%u, 1 thread, medians of %d rounds\n", argv[1], scene.image.width, scene.image.height, rounds);
  const std::size_t nearest = count_rays(queries, kinds[0]), shadows = count_rays(queries, kinds[1]);
  print("nearest hits, bare Embree", nearest, bare_alone[0], bare_alone[0]);
  print("nearest hits, accelerator", nearest, own[0], bare_alone[0]);
  print("shadows, bare Embree", shadows, bare_alone[1], bare_alone[1]);
  print("shadows, accelerator", shadows, own[1], bare_alone[1]);
  print("whole tracer", nearest + shadows, whole, bare_both);
  const auto own_bytes = static_cast<double>((*compiled)->accelerator->memory_bytes());
  const auto bare_bytes = static_cast<double>(bare.memory_bytes());
  std::printf("%-34s %9.1f MB, bare Embree %.1f MB %13s ratio %5.2f\n", "memory, tree and geometry", own_bytes / 1e6,
              bare_bytes / 1e6, "", own_bytes / bare_bytes);
  return 0;
}
