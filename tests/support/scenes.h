#pragma once
/// Scenes in a few lines, and their images through the tracer's public mouth.

#include <cstdint>
#include <string>
#include <vector>

#include "tracer/render.h"
#include "tracer/scene.h"

namespace scenes {

/// A scene of `side` x `side` pixels with one sample at each pixel's centre, a black background and no cutoff.
tracer::Scene empty(std::uint32_t side);

/// Adds a material or an object with it. Any material and shape may be given.
tracer::MaterialId add(tracer::Scene& scene, const tracer::Material& material);
void add(tracer::Scene& scene, tracer::Shape shape, tracer::MaterialId material);
void add(tracer::Scene& scene, tracer::Shape shape, const tracer::Material& material);

tracer::Light point_light(const tracer::Vec3& position, const tracer::Color& color = {1, 1, 1});
tracer::Light directional_light(const tracer::Vec3& direction, const tracer::Color& color = {1, 1, 1});

tracer::Material matte(const tracer::Color& color);       ///< K_a = K_d = 1
tracer::Material glowing(const tracer::Color& emission);  ///< nothing but emission
tracer::Material mirror(double reflection = 1);           ///< nothing but K_r
tracer::Material glass(double ior = 1.5);                 ///< nothing but fresnel, K_r = K_t = 1

/// An icosahedron's faces cut in four `levels` times, its corners on the unit sphere around 0; fronts outside.
tracer::Mesh icosphere(int levels, bool smooth = false);
/// Radii 1 and 0.4 around the z axis; fronts outside.
tracer::Mesh torus(std::uint32_t around, std::uint32_t across);
/// Every position p becomes p * scale + offset.
tracer::Mesh placed(tracer::Mesh mesh, double scale, const tracer::Vec3& offset);

/// A scene of spheres and planes with everything that tracing them can need, by a seed: all local models, both kinds of
/// light, attenuation, checkers, mirrors, glass with and without Fresnel, transmissive shadows, cutoff and depth.
tracer::Scene random(std::uint64_t seed, std::uint32_t side);

/// Everything below throws std::runtime_error, with the reason, where there is no image.
tracer::Rendered render(const tracer::Scene& scene, std::uint32_t threads = 1, const tracer::Assets& assets = {});

/// The image of `scene` with approximations. Its statistics are of the image alone: without the exact samples that
/// tell what the approximations cost. These are the same for all, so what is traced more for `harmless` tells them: an
/// approximation that changes nothing here, by default of scenes without meshes.
tracer::Rendered approximated(tracer::Scene scene, const tracer::Approximations& approximations,
                              const tracer::Approximations& harmless = {
                                  .shading = tracer::Approximations::Shading::flat});

/// 8-bit sRGB codes, as in a PNG.
std::vector<std::uint8_t> codes(const tracer::Image& image);

}  // namespace scenes
