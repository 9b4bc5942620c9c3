#pragma once
/// Builders of test scenes, and their images through the public interface.

#include <cstdint>
#include <memory>
#include <vector>

#include "tracer/render.h"
#include "tracer/scene.h"

namespace scenes {

/// A scene of `side` x `side` pixels with one sample at each pixel's center, a black background, no cutoff and a depth
/// of 64, so that nothing depends on chance.
tracer::Scene empty(std::uint32_t side, const tracer::Camera& camera = {});

/// Rays end by chance, as in a document that names neither `max_depth` nor `cutoff`. No material splits a ray into more
/// than it was, so that trees end.
void end_by_chance(tracer::Scene& scene);

/// Adds a material or an object with it. Any material and shape may be given.
tracer::MaterialId add(tracer::Scene& scene, const tracer::Material& material);
void add(tracer::Scene& scene, tracer::Shape shape, tracer::MaterialId material);
void add(tracer::Scene& scene, tracer::Shape shape, const tracer::Material& material);

/// Parallel rays through a window of this height.
tracer::Camera orthographic(const tracer::Vec3& position, const tracer::Vec3& look_at, double height,
                            const tracer::Vec3& up = {0, 1, 0});

tracer::Light point_light(const tracer::Vec3& position, const tracer::Color& color = {1, 1, 1});
tracer::Light directional_light(const tracer::Vec3& direction, const tracer::Color& color = {1, 1, 1});

tracer::Material matte(const tracer::Color& color);       ///< K_a = K_d = 1
tracer::Material glowing(const tracer::Color& emission);  ///< nothing but emission
tracer::Material mirror(double reflection = 1);           ///< nothing but K_r
tracer::Material glass(double ior = 1.5);                 ///< nothing but fresnel, K_r = K_t = 1

/// Two triangles between four corners in order.
tracer::Mesh quad(const tracer::Vec3& a, const tracer::Vec3& b, const tracer::Vec3& c, const tracer::Vec3& d);
/// An icosahedron subdivided `levels` times, with vertices on the unit sphere around 0; fronts outside.
tracer::Mesh icosphere(int levels, bool smooth = false);
/// Radii 1 and 0.4 around the z axis; fronts outside.
tracer::Mesh torus(std::uint32_t around, std::uint32_t across);
/// Every position p becomes p * scale + offset.
tracer::Mesh placed(tracer::Mesh mesh, double scale, const tracer::Vec3& offset);

/// A scene of spheres and planes with everything that tracing them can need, by a seed: all local models, both kinds of
/// light, attenuation, checkers, mirrors, glass with and without Fresnel, transmissive shadows, cutoff and depth.
tracer::Scene random(std::uint64_t seed, std::uint32_t side);

/// A room of five walls that is open toward the camera, lit by a lamp, with a mirror ball as its last object; 32 x 32
/// pixels. Every position p becomes p * scale + offset.
tracer::Scene room(double scale = 1, const tracer::Vec3& offset = {});

/// Sets global light: materials give back less light than they receive, and the first glows.
void light_globally(tracer::Scene& scene);

/// The functions below throw std::runtime_error with the reason if compiling or rendering fails.
std::shared_ptr<const tracer::CompiledScene> compiled(const tracer::Scene& scene, const tracer::Assets& assets = {});
tracer::Rendered render(const tracer::Scene& scene, std::uint32_t threads = 1, const tracer::Assets& assets = {});

/// Renders `scene` with approximations at fixed samples, without an error estimate and so without its rays.
tracer::Rendered approximated(tracer::Scene scene, const tracer::Approximations& approximations);

/// 8-bit sRGB codes, as in a PNG.
std::vector<std::uint8_t> codes(const tracer::Image& image);

}  // namespace scenes
