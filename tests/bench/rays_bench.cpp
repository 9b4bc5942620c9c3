/// Rays per second of a scene on one thread: the whole tracer (ray generation, intersection, shading, accumulation),
/// its accelerator alone, and bare Embree, all with the same camera, reflected, refracted and shadow rays, which are
/// recorded while the tracer renders the image. Bare Embree runs once with the coherence flags of the tracer and once
/// with all rays as coherent; the faster run counts. Times are CPU time, so that other processes affect them little;
/// ratios are computed per round. The scene may have spheres, triangles and planes.
///
///     rays_bench scenes/sphereflake.json [width height rounds [depth]]
///
/// The default depth is the document's. Memory: about 300 bytes per ray.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "api/render_document.h"
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

/// Runs queries on the accelerator, with room for the results of the largest one.
class Replay {
 public:
  explicit Replay(const std::vector<Query>& queries) : queries_(queries) {
    std::size_t count_max = 0;
    for (const Query& query : queries) count_max = std::max(count_max, query.rays().count);
    primitive_.resize(count_max);
    for (std::vector<double>* values : {&t_, &u_, &v_}) values->resize(count_max);
    occluded_.resize(count_max);
  }
  void run(const tracer::Accelerator& accelerator, Query::Kind kind) {
    for (const Query& query : queries_) {
      if (query.kind != kind) continue;
      if (kind == Query::Kind::occluded) {
        accelerator.occluded(query.rays(), occluded_.data(), query.coherence);
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
  std::vector<std::uint8_t> occluded_;
};

template <class Bytes>
Bytes read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(stream), {});
}

bool load(api::DocumentRender& render, const std::filesystem::path& path) {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  const auto read = [&](const std::string& name) -> api::AssetBytes {
    return read_file<std::vector<std::uint8_t>>(path.parent_path() / name);
  };
  return render.parse(read_file<std::string>(path), limits) && render.load(read, limits.scene);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void print(const char* name, std::size_t rays, const std::vector<double>& seconds, const std::vector<double>& bare) {
  std::vector<double> ratio;
  for (std::size_t i = 0; i < seconds.size(); ++i) ratio.push_back(seconds[i] / bare[i]);
  std::printf("%-34s %9zu rays %8.1f M/s   time / bare Embree %5.2f\n", name, rays,
              static_cast<double>(rays) / median(seconds) / 1e6, median(ratio));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: rays_bench scene.json [width height rounds]\n");
    return 2;
  }
  api::DocumentRender render;
  if (!load(render, argv[1])) {
    std::fprintf(stderr, "%s is not a valid scene; `whittle check` prints the reason\n", argv[1]);
    return 1;
  }
  tracer::Scene& scene = render.document.scene;
  scene.image.width = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[2])) : 1920;
  scene.image.height = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[3])) : 1080;
  scene.accuracy.samples = 1;
  const int rounds = argc > 4 ? std::atoi(argv[4]) : 7;
  if (argc > 5) scene.accuracy.max_depth = static_cast<std::uint32_t>(std::atoi(argv[5]));

  tracer::RenderControl control;
  if (!render.compile(control)) return 1;
  const tracer::CompiledScene& compiled = *render.compiled;
  if (!compiled.geometry().quadrics.empty()) {
    std::fprintf(stderr, "%s has shapes that Embree lacks\n", argv[1]);
    return 1;
  }
  std::vector<Query> queries;
  bool rendered = false;
  {
    bench::Recording recording;
    rendered = static_cast<bool>(tracer::render(compiled, {.threads = 1}, control));
    queries = std::move(recording.queries);
  }
  const bench::BareEmbree bare(compiled.geometry());
  Replay replay(queries);

  // Interleaved in each round, so that other load on the machine affects all alike.
  constexpr Query::Kind kinds[] = {Query::Kind::intersect, Query::Kind::occluded};
  std::vector<double> whole, accelerator[2], embree[2], embree_both;
  for (int round = 0; round < rounds; ++round) {
    for (int kind = 0; kind < 2; ++kind) {
      embree[kind].push_back(std::min(bare.trace_seconds(queries, kinds[kind], bench::BareEmbree::Flags::as_recorded),
                                      bare.trace_seconds(queries, kinds[kind], bench::BareEmbree::Flags::coherent)));
      accelerator[kind].push_back(seconds_of([&] { replay.run(*compiled.accelerator, kinds[kind]); }));
    }
    embree_both.push_back(embree[0].back() + embree[1].back());
    whole.push_back(seconds_of([&] { rendered = rendered && tracer::render(compiled, {.threads = 1}, control); }));
  }
  if (!rendered) return 1;
  std::printf("%s %ux%u, 1 thread, medians of %d rounds\n", argv[1], scene.image.width, scene.image.height, rounds);
  const std::size_t nearest = count_rays(queries, kinds[0]), shadows = count_rays(queries, kinds[1]);
  print("nearest hits, bare Embree", nearest, embree[0], embree[0]);
  print("nearest hits, accelerator", nearest, accelerator[0], embree[0]);
  print("shadows, bare Embree", shadows, embree[1], embree[1]);
  print("shadows, accelerator", shadows, accelerator[1], embree[1]);
  print("whole tracer", nearest + shadows, whole, embree_both);
  const auto accelerator_bytes = static_cast<double>(compiled.accelerator->memory_bytes());
  const auto embree_bytes = static_cast<double>(bare.memory_bytes());
  std::printf("%-34s %9.1f MB, bare Embree %.1f MB %13s ratio %5.2f\n", "memory, BVH and geometry",
              accelerator_bytes / 1e6, embree_bytes / 1e6, "", accelerator_bytes / embree_bytes);
  return 0;
}
