#include "tests/support/scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "tests/support/random.h"
#include "tracer/compile.h"
#include "tracer/src/display/srgb.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/pixel_sums.h"
#include "tracer/validate.h"

namespace scenes {

using namespace tracer;

Scene empty(std::uint32_t side, const Camera& camera) {
  Scene scene;
  scene.image = {side, side};
  scene.camera = camera;
  scene.accuracy.samples = 1;
  scene.accuracy.cutoff = 0;
  scene.accuracy.max_depth = 64;
  return scene;
}

void end_by_chance(Scene& scene) {
  scene.accuracy.max_depth.reset();
  scene.accuracy.cutoff.reset();
  for (Material& material : scene.materials) {
    const double sum = material.fresnel ? 1 : std::max(1.0, material.reflection + material.transmission);
    material.reflection /= sum;
    material.transmission /= sum;
  }
}

MaterialId add(Scene& scene, const Material& material) {
  scene.materials.push_back(material);
  return {static_cast<std::uint32_t>(scene.materials.size() - 1)};
}

void add(Scene& scene, Shape shape, MaterialId material) { scene.objects.push_back({std::move(shape), material, {}}); }

void add(Scene& scene, Shape shape, const Material& material) { add(scene, std::move(shape), add(scene, material)); }

Camera orthographic(const Vec3& position, const Vec3& look_at, double height, const Vec3& up) {
  return {.position = position, .look_at = look_at, .up = up, .type = Camera::Type::orthographic, .height = height};
}

Light point_light(const Vec3& position, const Color& color) { return {.source = PointLight{position}, .color = color}; }

Light directional_light(const Vec3& direction, const Color& color) {
  return {.source = DirectionalLight{direction}, .color = color};
}

Material matte(const Color& color) {
  Material material;
  material.model = Material::Model::lambert;
  material.color = color;
  return material;
}

Material glowing(const Color& emission) {
  Material material = matte({0, 0, 0});
  material.emission = emission;
  return material;
}

Material mirror(double reflection) {
  Material material = matte({0, 0, 0});
  material.reflection = reflection;
  return material;
}

Material glass(double ior) {
  Material material = mirror(1);
  material.transmission = 1;
  material.ior = ior;
  material.fresnel = true;
  return material;
}

namespace {

Vec3 on_unit_sphere(const Vec3& v) {
  const double r = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
  return {v.x / r, v.y / r, v.z / r};
}

}  // namespace

Mesh quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return {{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}, {}, {}};
}

Mesh icosphere(int levels, bool smooth) {
  const double g = std::numbers::phi;
  Mesh mesh;
  mesh.smooth = smooth;
  for (const Vec3& p :
       {Vec3{-1, g, 0}, Vec3{1, g, 0}, Vec3{-1, -g, 0}, Vec3{1, -g, 0}, Vec3{0, -1, g}, Vec3{0, 1, g}, Vec3{0, -1, -g},
        Vec3{0, 1, -g}, Vec3{g, 0, -1}, Vec3{g, 0, 1}, Vec3{-g, 0, -1}, Vec3{-g, 0, 1}})
    mesh.positions.push_back(on_unit_sphere(p));
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [place, added] = middles.try_emplace(std::minmax(a, b), mesh.positions.size());
      if (added) {
        const Vec3 p = mesh.positions[a], q = mesh.positions[b];
        mesh.positions.push_back(on_unit_sphere({p.x + q.x, p.y + q.y, p.z + q.z}));
      }
      return place->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& triangle : {std::array{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
        finer.push_back(triangle);
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

Mesh torus(std::uint32_t around, std::uint32_t across) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * j / across;
      const double r = 1 + 0.4 * std::cos(b);
      mesh.positions.push_back({r * std::cos(a), r * std::sin(a), 0.4 * std::sin(b)});
      const std::uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      mesh.triangles.push_back({i * across + j, i1 * across + j, i1 * across + j1});
      mesh.triangles.push_back({i * across + j, i1 * across + j1, i * across + j1});
    }
  return mesh;
}

Mesh placed(Mesh mesh, double scale, const Vec3& offset) {
  for (Vec3& p : mesh.positions) p = {p.x * scale + offset.x, p.y * scale + offset.y, p.z * scale + offset.z};
  return mesh;
}

namespace {

/// The value of what succeeded.
template <class Value>
Value value_of(Result<Value, Failure> result) {
  if (!result) throw std::runtime_error(result.error().detail);
  return std::move(*result);
}

/// Draws the parts of one random scene.
class Draw : public oracle::Random {
 public:
  using Random::Random;

  Material material(Scene& scene) {
    Material m;
    m.model = static_cast<Material::Model>(below(3));
    m.color = color();
    if (chance(0.3)) m.color = checker(scene);
    m.ambient = in(0, 1);
    m.diffuse = in(0, 1);
    m.specular = chance(0.5) ? in(0, 1) : 0;
    m.shininess = chance(0.1) ? 0 : spread(1, 1000);
    m.specular_color = color();
    if (chance(0.1)) m.emission = color();
    if (chance(0.4)) m.reflection = in(0, 1);
    m.reflection_color = color(0.5);
    if (chance(0.4)) m.transmission = in(0, 1);
    m.transmission_color = color(0.5);
    m.ior = chance(0.3) ? in(0.4, 1) : in(1, 2.5);
    m.fresnel = chance(0.5);
    for (ColorOrTexture* other : {&m.specular_color, &m.emission, &m.reflection_color, &m.transmission_color})
      if (chance(0.1)) *other = checker(scene);
    if (chance(0.2)) m.diffuse_transmission = in(0, 1);
    m.diffuse_transmission_color = chance(0.3) ? ColorOrTexture(checker(scene)) : color();
    if (chance(0.2)) m.specular_transmission = in(0, 1);
    if (m.transmission == 0 && !m.fresnel && chance(0.2))
      m.opacity = chance(0.5) ? checker(scene) : ColorOrTexture(color());
    return m;
  }

  TextureId checker(Scene& scene) {
    Texture texture{CheckerTexture{{color(), color()}}, {in(1, 9), in(1, 9)}, {in(-2, 2), in(-2, 2)}, ""};
    texture.filter = Texture::Filter::nearest;  // the reference tracer has no ray cones
    scene.textures.push_back(texture);
    return {static_cast<std::uint32_t>(scene.textures.size() - 1)};
  }

  Light light() {
    Light light = chance(0.7) ? point_light(vector(8), color()) : directional_light(vector(1), color());
    light.intensity = in(0, 1.5);
    light.shadows = chance(0.8);
    if (chance(0.3)) light.attenuation = {Attenuation::Kind::polynomial, {in(0, 1), in(0, 0.2), in(0, 0.05)}};
    if (chance(0.2)) light.attenuation.kind = Attenuation::Kind::inverse_square;
    return light;
  }
};

}  // namespace

Scene random(std::uint64_t seed, std::uint32_t side) {
  Draw draw(seed);
  Scene scene = empty(side, {draw.vector(6), draw.vector(1), {0, 1, 0}, draw.in(20, 100)});
  scene.background.color = draw.color();
  scene.ambient = draw.color();
  for (int i = 0; i < 2; ++i) scene.lights.push_back(draw.light());
  for (int i = 0; i < 6; ++i) {
    const Sphere sphere{draw.vector(2.5), draw.spread(0.13, 1.4), draw.vector(1), draw.vector(1)};
    add(scene, sphere, draw.material(scene));
  }
  for (int i = 0; i < 2; ++i) {
    Plane plane{draw.vector(1), draw.vector(1), {}};
    plane.point.y -= 4;
    if (draw.chance(0.5)) plane.u_axis = draw.vector(1);
    add(scene, plane, draw.material(scene));
  }
  scene.accuracy.max_depth = static_cast<std::uint32_t>(draw.in(0, 7));
  scene.accuracy.cutoff = draw.chance(0.5) ? 0.003 : 0;
  return scene;
}

Scene room(double scale, const Vec3& offset) {
  Scene scene = empty(32);
  const auto at = [&](const Vec3& p) { return p * scale + offset; };
  scene.camera = {at({0, 0, 3.25}), at({0, 0, 0}), {0, 1, 0}, 45};
  const auto rectangle = [&](const Vec3& corner, const Vec3& u, const Vec3& v, const Material& material) {
    add(scene, quad(at(corner), at(corner + u), at(corner + u + v), at(corner + v)), material);
  };
  const Material white = matte({0.8, 0.8, 0.8});
  rectangle({-1, -1, -1}, {2, 0, 0}, {0, 0, 2}, white);
  rectangle({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, white);
  rectangle({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, white);
  rectangle({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, matte({0.8, 0.1, 0.1}));
  rectangle({1, -1, -1}, {0, 2, 0}, {0, 0, 2}, matte({0.1, 0.6, 0.1}));
  constexpr double half = 0.3125, height = 0.8125;  // sums with offsets are exact
  rectangle({-half, height, -half}, {2 * half, 0, 0}, {0, 0, 2 * half}, glowing({4, 3, 2}));
  add(scene, Sphere{at({-0.375, -0.625, -0.25}), 0.375 * scale}, mirror(0.9));
  return scene;
}

void light_globally(Scene& scene) {
  scene.accuracy.model = Accuracy::Model::global;
  for (Material& material : scene.materials)
    for (double Material::*share :
         {&Material::diffuse, &Material::diffuse_transmission, &Material::reflection, &Material::transmission})
      material.*share /= 4;
  scene.materials.front().emission = Color{0.6, 0.5, 0.3};
}

std::shared_ptr<const CompiledScene> compiled(const Scene& scene, const Assets& assets) {
  RenderControl control;
  return value_of(compile(scene, control, assets));
}

Rendered render(const Scene& scene, std::uint32_t threads, const Assets& assets) {
  if (const auto issues = validate(scene, Limits{}); !issues.empty())
    throw std::runtime_error(issues[0].pointer + ": " + issues[0].detail);
  RenderControl control;
  return value_of(tracer::render(*compiled(scene, assets), {.threads = threads}, control));
}

Rendered approximated(Scene scene, const Approximations& approximations) {
  scene.accuracy.approximate = approximations;
  const RenderControl control;
  const auto compiled = scenes::compiled(scene);
  Wavefront<AllFeatures> tracer(*compiled, control, approximations);
  const Tiles tiles(scene.image.window());
  const std::uint32_t count = scene.accuracy.samples;
  Rendered rendered;
  allocate(rendered.image, scene.image.window(), scene.output);
  for (std::uint64_t tile = 0; tile < tiles.count(); ++tile) {
    const std::vector<Pixel> pixels = tiles.pixels(tile);
    fill(tracer.batch(), *compiled, pixels, {0, count, count});
    tracer.batch().light_points = (15 + count) / count;
    tracer.trace();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      PixelAccumulator sum;
      for (std::size_t sample = i; sample < tracer.radiance().size(); sample += pixels.size())
        sum.add(tracer.radiance()[sample]);
      sum.write(rendered.image.rgb.data() + 3 * tiles.place(pixels[i]));
    }
  }
  rendered.statistics = tracer.statistics();
  rendered.statistics.samples_min = rendered.statistics.samples_max = count;
  return rendered;
}

std::vector<std::uint8_t> codes(const Image& image) {
  std::vector<std::uint8_t> result(image.rgb.size());
  srgb8_from_linear(image.rgb, result);
  return result;
}

}  // namespace scenes
