/// Principled spheres in light from everywhere, whose radiance is known in closed form.
#include "tests/property/global_radiance.h"

using namespace tracer;

namespace {

/// A sphere of this material, from near its middle at the cosine `cosine` of its normal, in white light: of the
/// background, or of a lamp around it, which is sampled as well.
Scene ball(const Material& material, double cosine, bool lamp) {
  Scene scene = scenes::empty(8);
  const double sine = std::sqrt(1 - cosine * cosine);
  scene.camera = {
      .position = {sine, 0, 5}, .look_at = {sine, 0, 0}, .type = Camera::Type::orthographic, .height = 0.02};
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.samples = 64;
  scene.accuracy.max_depth.reset();
  scene.accuracy.cutoff.reset();
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, material);
  if (lamp) {
    scenes::add(scene, Sphere{{0, 0, 0}, 20}, surface(0, 1));
  } else {
    scene.background.color = {1, 1, 1};
  }
  return scene;
}

Material principled(double base, double metallic, double roughness) {
  Material material;
  material.model = Material::Model::principled;
  material.color = Color{base, base, base};
  material.metallic = Color{metallic, metallic, metallic};
  material.roughness = Color{roughness, roughness, roughness};
  material.specular = 1;
  return material;
}

TEST(PrincipledBalls, VanishInTheirLightIfTheyAreWhite) {
  for (const bool lamp : {false, true})
    for (const double roughness : {0.0, 0.2, 0.5, 1.0})
      for (const int kind : {0, 1, 2, 3}) {  // plastic, half metal, metal, glass
        Material white = principled(1, kind == 3 ? 0 : kind / 2.0, roughness);
        if (kind == 3) {
          white.transmission = white.reflection = 1;
          white.fresnel = true;
        }
        for (const double cosine : {0.95, 0.4}) {
          const Mean found = radiance(ball(white, cosine, lamp), 4);
          EXPECT_NEAR(found.value, 1, 0.005 + 4 * found.error)
              << lamp << ' ' << roughness << ' ' << kind << ' ' << cosine;
        }
      }
}

TEST(PrincipledBalls, OfRoughGlassVanishForEveryIndexFromOutsideAndInside) {
  for (const double ior : {1.1, 1.5, 2.4})
    for (const double roughness : {0.1, 0.3, 0.6, 1.0})
      for (const bool inside : {false, true}) {
        Material white = principled(1, 0, roughness);
        white.transmission = white.reflection = 1;
        white.fresnel = true;
        white.ior = ior;
        Scene scene = ball(white, 0.6, false);
        if (inside) scene.camera.position.z = -0.3;
        const Mean found = radiance(scene, 4);
        EXPECT_NEAR(found.value, 1, 0.005 + 4 * found.error) << ior << ' ' << roughness << ' ' << inside;
      }
}

/// Reflectance of white facets by quadrature (Walter et al. 2007; Heitz 2014), and its share of f0.
std::pair<double, double> facets(double cosine, double alpha) {
  constexpr int steps = 400;
  const double sine = std::sqrt(1 - cosine * cosine), a2 = alpha * alpha;
  const auto root = [&](double c) { return std::sqrt(a2 + (1 - a2) * c * c); };
  double all = 0, normal = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const double angle = pi / 2 * (i + 0.5) / steps, phi = 2 * pi * (j + 0.5) / steps, c = std::cos(angle),
                   s = std::sin(angle);
      const double along = sine * s * std::cos(phi) + cosine * c, half = std::sqrt((1 + along) / 2);  // v.l and v.h
      const double h = (c + cosine) / (2 * half), slope = h * h * (a2 - 1) + 1;
      const double value = a2 / (pi * slope * slope) / (2 * (cosine * root(c) + c * root(cosine))) * c * s *
                           (pi / 2 / steps) * (2 * pi / steps);
      all += value;
      normal += value * (1 - std::pow(1 - half, 5));
    }
  return {all, normal};
}

TEST(PrincipledBalls, OfRoughMetalHaveTheReflectanceOfTheirFacets) {
  constexpr double f0 = 0.5;
  for (const double roughness : {0.4, 0.8})
    for (const double cosine : {0.9, 0.5}) {
      const double alpha = roughness * roughness;
      double mean = 0;
      for (int i = 0; i < 20; ++i) mean += facets((i + 0.5) / 20, alpha).first * (i + 0.5) / 200;
      const auto [all, normal] = facets(cosine, alpha);
      const double average = (20 * f0 + 1) / 21, several = average * average * mean / (1 - average * (1 - mean));
      const double truth = f0 * normal + (all - normal) + several * (1 - all);
      for (const bool lamp : {false, true}) {
        const Mean found = radiance(ball(principled(f0, 1, roughness), cosine, lamp), 4);
        EXPECT_NEAR(found.value, truth, 0.005 + 4 * found.error) << lamp << ' ' << roughness << ' ' << cosine;
      }
    }
}

TEST(PrincipledBalls, ApproximatedByMirrorsStateTheirError) {
  Scene scene = ball(principled(1, 1, 0.5), 0.9, false);
  scene.background.gradient = Gradient{{1, 1, 1}, {0, 0, 0}};
  scene.camera.height = 2;
  scene.accuracy.samples = 64;
  scene.accuracy.model = Accuracy::Model::whitted;
  Scene mirror = scene;
  mirror.accuracy.approximate.mirror_roughness = 0.5;
  const Rendered exact = scenes::render(scene), approximated = scenes::render(mirror);
  const double distance = compare(to_display(exact.image, {}), to_display(approximated.image, {}))->rmse;
  EXPECT_GT(distance, 2);
  EXPECT_GE(approximated.error.estimate, distance - exact.error.estimate);
  EXPECT_GE(approximated.error.estimate, approximated.error.approximation);
}

}  // namespace
