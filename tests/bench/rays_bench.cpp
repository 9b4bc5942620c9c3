/// Rays per second of a scene's camera and shadow rays, one thread: the whole tracer (rays made, traced, shaded,
/// summed), its accelerator alone, and bare Embree on exactly the same rays. Seconds are the processor's, so that the
/// machine may do other work beside; ratios are taken within one run, round by round.
///
///     rays_bench scenes/sphereflake.json [width height rounds]

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "api/document.h"
#include "tests/bench/bare_embree.h"
#include "tracer/render.h"
#include "tracer/src/integrator/ray_queue.h"
#include "tracer/src/shapes/surface.h"

namespace {

using tracer::RayQueue;

/// The rays that the tracer sends at depth 0, in its order.
struct Rays {
  RayQueue camera, shadow;
  std::vector<double> shadow_distance;
};

template <class Work>
double seconds_of(const Work& work) {
  const double start = bench::processor_seconds();
  work();
  return bench::processor_seconds() - start;
}

void add_shadow_rays(const tracer::CompiledScene& scene, const RayQueue& camera, Rays& rays) {
  std::vector<tracer::PrimitiveRef> primitive(camera.size());
  std::vector<double> t(camera.size()), u(camera.size()), v(camera.size());
  scene.accelerator->closest(camera.span(), {primitive.data(), t.data(), u.data(), v.data()},
                             tracer::Coherence::coherent);
  for (const tracer::TraceLight& light : scene.lights)
    for (std::size_t i = 0; i < camera.size(); ++i) {
      if (!primitive[i].hit()) continue;
      const auto surface =
          tracer::surface_at(scene, {primitive[i], t[i], u[i], v[i]}, camera.origin(i), camera.direction(i));
      const tracer::Vec3 offset = light.position - surface.point.position;
      const bool directional = light.kind == tracer::TraceLight::Kind::directional;
      const tracer::Vec3 to_light = directional ? light.axis : normalize(offset);
      if (dot(surface.normal, to_light) <= 0) continue;
      rays.shadow.push(offset_origin(surface.point, surface.geometric_normal, to_light), to_light, {1, 1, 1}, 0,
                       primitive[i], 0, 0);
      rays.shadow_distance.push_back(directional ? HUGE_VAL : length(offset));
    }
}

void push(RayQueue& camera, const tracer::TraceCamera::Aim& aim) {
  camera.push(aim.origin, aim.direction, {1, 1, 1}, 0, {}, 0, 0);
}

Rays depth_zero_rays(const tracer::CompiledScene& scene) {
  constexpr std::uint32_t tile = 32, block = 4;
  Rays rays;
  for (std::uint32_t ty = 0; ty < scene.image.height; ty += tile)
    for (std::uint32_t tx = 0; tx < scene.image.width; tx += tile) {
      RayQueue camera;
      for (std::uint32_t by = ty; by < std::min(ty + tile, scene.image.height); by += block)
        for (std::uint32_t bx = tx; bx < std::min(tx + tile, scene.image.width); bx += block)
          for (std::uint32_t y = by; y < std::min(by + block, scene.image.height); ++y)
            for (std::uint32_t x = bx; x < std::min(bx + block, scene.image.width); ++x)
              push(camera, scene.camera.aim(x + 0.5, y + 0.5));
      for (std::size_t i = 0; i < camera.size(); ++i) rays.camera.push(camera, i);
      add_shadow_rays(scene, camera, rays);
    }
  return rays;
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
  std::stringstream bytes;
  bytes << std::ifstream(argv[1]).rdbuf();
  auto document = api::parse_scene(bytes.str(), {});
  if (!document) {
    std::fprintf(stderr, "%s: not a scene; `whittle check` tells why\n", argv[1]);
    return 1;
  }
  tracer::Scene& scene = document->scene;
  scene.image.width = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[2])) : 1920;
  scene.image.height = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[3])) : 1080;
  scene.accuracy.samples = 1;
  scene.accuracy.max_depth = 0;
  const int rounds = argc > 4 ? std::atoi(argv[4]) : 7;

  tracer::RenderControl control;
  auto compiled = tracer::compile(scene, control);
  if (!compiled) return 1;
  const Rays rays = depth_zero_rays(**compiled);
  const bench::BareEmbree bare((*compiled)->geometry());
  const auto camera = rays.camera.span();
  const auto shadow = rays.shadow.span(rays.shadow_distance.data());
  std::vector<tracer::PrimitiveRef> primitive(camera.count);
  std::vector<double> t(camera.count), u(camera.count), v(camera.count);
  std::vector<std::uint8_t> blocked(shadow.count);

  std::vector<double> whole, own_camera, own_shadow, bare_camera, bare_shadow, bare_both;
  bool rendered = true;
  for (int round = 0; round < rounds; ++round) {
    bare_camera.push_back(bare.closest(camera).seconds);
    bare_shadow.push_back(bare.occluded(shadow).seconds);
    bare_both.push_back(bare_camera.back() + bare_shadow.back());
    own_camera.push_back(seconds_of([&] {
      (*compiled)->accelerator->closest(camera, {primitive.data(), t.data(), u.data(), v.data()},
                                        tracer::Coherence::coherent);
    }));
    own_shadow.push_back(
        seconds_of([&] { (*compiled)->accelerator->occluded(shadow, blocked.data(), tracer::Coherence::coherent); }));
    whole.push_back(seconds_of([&] { rendered = rendered && tracer::render(**compiled, {.threads = 1}, control); }));
  }
  if (!rendered) return 1;
  std::printf("%s %ux%u, 1 thread, medians of %d rounds\n", argv[1], scene.image.width, scene.image.height, rounds);
  print("camera rays, bare Embree", camera.count, bare_camera, bare_camera);
  print("camera rays, accelerator", camera.count, own_camera, bare_camera);
  print("shadow rays, bare Embree", shadow.count, bare_shadow, bare_shadow);
  print("shadow rays, accelerator", shadow.count, own_shadow, bare_shadow);
  print("camera + shadow, whole tracer", camera.count + shadow.count, whole, bare_both);
  const auto own_bytes = static_cast<double>((*compiled)->accelerator->memory_bytes());
  const auto bare_bytes = static_cast<double>(bare.memory_bytes());
  std::printf("%-34s %9.1f MB, bare Embree %.1f MB %13s ratio %5.2f\n", "memory, tree and geometry", own_bytes / 1e6,
              bare_bytes / 1e6, "", own_bytes / bare_bytes);
  return 0;
}
