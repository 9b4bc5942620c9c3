#include "tests/unit/certify/random_scene.h"

#include <sstream>
#include <stdexcept>

#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/encode.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/validate.h"

namespace certify {

using namespace tracer;

namespace {

/// Draws the parts of a scene about `scale` wide around `origin`.
class Draw : public oracle::Random {
 public:
  explicit Draw(std::uint64_t seed) : oracle::Random(seed) {}

  RandomScene scene() {
    RandomScene random;
    Scene& scene = random.scene;
    only_triangles_ = chance(0.2);
    scale_ = chance(0.7) ? 1 : spread(1e-5, 1e5);
    if (chance(0.2)) origin_ = vector(100 * scale_);
    scene.image = {20, 16};
    scene.camera = camera();
    scene.accuracy.samples = chance(0.5) ? 1 : 4;  // a single one passes the center of the lens
    scene.accuracy.cutoff = chance(0.5) ? 0 : 0.01;
    scene.accuracy.max_depth = chance(0.7) ? 6 : below(3);
    if (chance(0.08)) scene.accuracy.approximate = approximations();
    if (chance(0.3)) scene.ambient = color();
    textures(random);
    background(scene);
    const std::uint32_t lights = chance(0.05) ? 70 : only_triangles_ ? 1 : below(4);
    for (std::uint32_t i = 0; i < lights; ++i) scene.lights.push_back(light());
    const std::uint32_t materials = 1 + below(4);
    plain_ = only_triangles_ || chance(0.4);
    for (std::uint32_t i = 0; i < materials; ++i) scene.materials.push_back(material(scene));
    if (chance(0.6)) add(scene, Plane{at(in(-1, -0.3)), chance(0.5) ? Vec3{0, 1, 0} : vector(1), {}});
    const std::uint32_t objects = below(7);
    for (std::uint32_t i = 0; i < objects; ++i) add(scene, shape());
    if (chance(0.1)) scene.medium.absorption = {in(0, 0.3) / scale_, 0, in(0, 1) / scale_};
    if (scene.camera.layout == Camera::Layout::anaglyph) return random;
    if (chance(0.1)) scene.depth_cue = DepthCue{in(0, 2) * scale_, in(2, 8) * scale_, in(0.5, 1), in(0, 0.5), color()};
    if (chance(0.1)) scene.output.alpha = true;
    if (chance(0.15)) scenes::light_globally(scene);
    return random;
  }

 private:
  Vec3 at(double height) { return {origin_.x, origin_.y + height * scale_, origin_.z}; }
  Vec3 point(double reach) {
    const Vec3 v = vector(reach * scale_);
    return {v.x + origin_.x, v.y + origin_.y, v.z + origin_.z};
  }
  double size(double low, double high) { return spread(low, high) * scale_; }

  Camera camera() {
    Camera camera{point(4), point(0.7), {0, 1, 0}, spread(2, 120)};
    if (chance(0.1)) camera.position = point(400);
    if (chance(0.25)) {
      camera.type = Camera::Type::orthographic;
      camera.height = size(0.1, 6);
    } else if (chance(0.1)) {
      camera.type = Camera::Type::panorama;
    }
    if (chance(0.15)) camera.aperture = size(0.0005, 0.3);
    if (camera.type != Camera::Type::panorama && chance(0.1)) {
      camera.layout = chance(0.5) ? Camera::Layout::side_by_side : Camera::Layout::anaglyph;
      camera.eye_separation = size(0.01, 1);
    }
    return camera;
  }

  Approximations approximations() {
    Approximations approximate;
    approximate.shadows = static_cast<Approximations::Shadows>(below(3));
    approximate.reflections = static_cast<Approximations::Reflections>(below(3));
    approximate.shading = static_cast<Approximations::Shading>(below(3));
    approximate.nearest_lights = below(3);
    return approximate;
  }

  void textures(RandomScene& random) {
    Image image{8 + below(9), 8 + below(9), {}};
    for (std::uint32_t i = 0; i < 3 * image.width * image.height; ++i)
      image.rgb.push_back(static_cast<float>(in(0, 1)));
    random.assets.bytes.push_back(encode(image, Format::png)->bytes);
    random.scene.assets.push_back({"image.png", "/textures/t3"});
    const std::array<Color, 2> colors{color(), color()};
    const auto put = [&](auto pattern) {
      Texture texture;
      texture.pattern = pattern;
      texture.scale = {in(-6, 6), spread(0.1, 6)};
      texture.offset = {in(-1, 1), in(-1, 1)};
      texture.wrap = static_cast<Texture::Wrap>(below(3));
      texture.filter = static_cast<Texture::Filter>(below(3));
      texture.path = "/textures/t" + std::to_string(random.scene.textures.size());
      random.scene.textures.push_back(texture);
    };
    put(CheckerTexture{colors});
    put(GradientTexture{colors});
    put(NoiseTexture{colors, 1 + below(3)});
    put(ImageTexture{AssetId{0}, std::nullopt});
  }

  TextureId texture() { return {below(4)}; }

  void background(Scene& scene) {
    scene.background.color = color();
    if (chance(0.2))
      scene.background.gradient = Gradient{color(), color()};
    else if (chance(0.15))
      scene.background.environment = Environment{texture(), in(0, 360)};
    else if (chance(0.1))
      scene.background.cube = CubeMap{{texture(), texture(), texture(), texture(), texture(), texture()}};
  }

  decltype(Light::source) light_source() {
    const double reach = chance(0.5) ? 3 : 1;
    switch (below(7)) {
      case 0:
        return DirectionalLight{vector(1)};
      case 1:
        return SpotLight{point(reach), vector(1), in(1, 30), in(30, 60)};
      case 2:
        return LineLight{point(reach), point(reach)};
      case 3:
        return RectLight{point(reach), vector(0.3 * scale_), vector(0.3 * scale_)};
      case 4:
        return DiscLight{point(reach), vector(1), size(0.01, 0.5)};
      case 5:
        return SphereLight{point(reach), size(0.01, 0.5)};
      default:
        return PointLight{point(reach)};
    }
  }

  Light light() {
    Light light;
    light.source = light_source();
    light.color = color();
    light.intensity = spread(0.1, 3);
    light.shadows = chance(0.85);
    if (chance(0.2))
      light.attenuation = {Attenuation::Kind::polynomial, {in(0, 1), in(0, 1) / scale_, in(0, 1) / (scale_ * scale_)}};
    else if (chance(0.15))
      light.attenuation.kind = Attenuation::Kind::inverse_square;
    return light;
  }

  Material material(const Scene&) {
    Material m;
    m.model = static_cast<Material::Model>(below(3));
    m.color = color();
    if (chance(0.35)) m.color = texture();
    m.ambient = in(0, 1);
    m.diffuse = in(0, 1);
    if (chance(0.5)) m.specular = in(0, 1);
    m.shininess = chance(0.1) ? 0 : spread(1, 300);
    m.specular_color = color();
    if (chance(0.15)) m.emission = color();
    if (chance(0.1)) m.emission = texture();
    if (chance(0.1)) m.diffuse_transmission = in(0, 1);
    if (chance(0.1)) m.specular_transmission = in(0, 1);
    m.diffuse_transmission_color = chance(0.2) ? ColorOrTexture(texture()) : color();
    if (plain_) return m;
    if (chance(0.4)) m.reflection = in(0, 1);
    m.reflection_color = color(0.5);
    if (chance(0.3)) m.transmission = in(0, 1);
    m.transmission_color = color(0.5);
    m.transparency = static_cast<Material::Transparency>(below(3));
    m.ior = chance(0.3) ? in(0.5, 1) : in(1, 2.2);
    m.priority = static_cast<int>(below(2));
    if (chance(0.2)) m.absorption = {in(0, 1) / scale_, in(0, 1) / scale_, in(0, 1) / scale_};
    m.fresnel = chance(0.4);
    for (ColorOrTexture* other : {&m.specular_color, &m.reflection_color, &m.transmission_color})
      if (chance(0.15)) *other = texture();
    m.shading = static_cast<Material::Shading>(below(4));
    const bool refracts = m.transmission > 0 && m.transparency == Material::Transparency::refract;
    if (!refracts && !m.fresnel && chance(0.3)) m.opacity = chance(0.5) ? texture() : ColorOrTexture(color());
    if (chance(0.08)) m.normal_map = texture();
    if (chance(0.08)) m.bump = Bump{texture(), in(-0.05, 0.05) * scale_};
    return m;
  }

  Mesh mesh() {
    Mesh mesh = chance(0.6) ? scenes::icosphere(static_cast<int>(below(3)), chance(0.5)) : scenes::torus(9, 6);
    if (chance(0.3)) mesh.smooth = true;
    mesh = scenes::placed(std::move(mesh), size(0.1, 1), point(0.8));
    if (chance(0.4))
      for (std::size_t i = 0; i < mesh.positions.size(); ++i) mesh.uvs.push_back({in(0, 1), in(0, 1)});
    return mesh;
  }

  Shape shape() {
    switch (only_triangles_ ? 6 + below(2) : below(9)) {
      case 0:
        return Plane{point(1), vector(1), {}};
      case 1:
        return Disc{point(0.8), vector(1), size(0.1, 1.5), chance(0.3) ? size(0.01, 0.09) : 0, {}};
      case 2:
        return Cylinder{point(0.8), point(0.8), size(0.05, 0.6), chance(0.7), {}};
      case 3:
        return Cone{point(0.8), point(0.8), size(0.05, 0.6), chance(0.5) ? 0 : size(0.05, 0.6), chance(0.7), {}};
      case 4: {
        const Vec3 low = point(0.8);
        return Box{low, {low.x + size(0.05, 1.5), low.y + size(0.05, 1.5), low.z + size(0.05, 1.5)}};
      }
      case 5: {
        const double radius = size(0.2, 0.8);
        return Torus{point(0.8), vector(1), radius, radius * in(0.05, 0.9), {}};
      }
      case 6: {
        Triangle triangle{{point(1.5), point(1.5), point(1.5)}, {}, {}};
        if (chance(0.3)) triangle.normals = std::array{vector(1), vector(1), vector(1)};
        if (chance(0.3)) triangle.uvs = std::array{Vec2{in(0, 1), in(0, 1)}, Vec2{in(0, 1), 1}, Vec2{0, in(0, 1)}};
        return triangle;
      }
      case 7:
        return mesh();
      default:
        return Sphere{point(0.8), size(0.02, 1.2), vector(1), vector(1)};
    }
  }

  void add(Scene& scene, Shape shape) {
    Object object{std::move(shape), MaterialId{below(static_cast<std::uint32_t>(scene.materials.size()))}, {}};
    if (chance(0.25)) {
      Transform transform;
      for (auto& row : transform.rows)
        for (std::size_t i = 0; i < 3; ++i) row[i] += in(-0.5, 0.5);
      // About the origin of the scene.
      const double o[3] = {origin_.x, origin_.y, origin_.z};
      for (std::size_t i = 0; i < 3; ++i) {
        transform.rows[i][3] = o[i];
        for (std::size_t j = 0; j < 3; ++j) transform.rows[i][3] -= transform.rows[i][j] * o[j];
      }
      object.transform = transform;
    }
    scene.objects.push_back(std::move(object));
  }

  double scale_ = 1;
  Vec3 origin_{};
  bool plain_ = false, only_triangles_ = false;
};

}  // namespace

const InParallel one_by_one = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
  for (std::uint64_t i = 0; i < count; ++i) work(i);
};

RandomScene random_scene(std::uint64_t seed) { return Draw(seed).scene(); }

std::vector<RadianceInterval> intervals_of(const CompiledScene& scene, const InParallel& in_parallel,
                                           RenderControl& control) {
  std::vector<RadianceInterval> intervals(scene.image.window().pixels(), {.low = {1, 1, 1}, .high = {0, 0, 0}});
  bound_pixels(
      scene, in_parallel, control, [] { return false; },
      [&](std::size_t place, const RadianceInterval& interval) { intervals[place] = interval; });
  return intervals;
}

Comparison compare(const CompiledScene& scene, const std::vector<RadianceInterval>& intervals, std::uint32_t per_pixel,
                   std::uint64_t seed) {
  oracle::Random random(seed);
  RenderControl control;
  Wavefront<AllFeatures> tracer(scene, control, {});
  const PixelWindow window = scene.image.window();
  Comparison result;
  for (std::uint32_t round = 0; round < per_pixel; ++round) {
    Batch& batch = tracer.batch();
    batch.clear();
    batch.light_points = 1;
    for (std::uint32_t y = window.y0; y < window.y1; ++y)
      for (std::uint32_t x = window.x0; x < window.x1; ++x) {
        // One in eight at the border of the pixel.
        const auto inside = [&] {
          return random.chance(0.06) ? (random.chance(0.5) ? 0 : 1 - 0x1p-40) : random.in(0, 1);
        };
        batch.samples.push_back({static_cast<std::uint64_t>(random.in(0, 1e18)), random.below(1u << 30)});
        batch.x.push_back(x + inside());
        batch.y.push_back(y + inside());
        batch.lens.push_back({random.in(0, 1), random.in(0, 1)});
        batch.share.push_back(random.chance(0.2) ? 1 : random.in(0, 1));
      }
    if (!tracer.trace()) throw std::runtime_error("not traced");
    for (std::size_t i = 0; i < intervals.size(); ++i) {
      const Color& radiance = tracer.radiance()[i];
      const double channels[3] = {radiance.r, radiance.g, radiance.b};
      bool outside = false;
      for (std::size_t c = 0; c < 3; ++c)
        outside |= !(channels[c] >= intervals[i].low[c] && channels[c] <= intervals[i].high[c]);
      ++result.samples;
      if (!outside || result.outside++ != 0) continue;
      std::ostringstream text;
      text.precision(12);
      text << "pixel " << i % window.width() << ", " << i / window.width() << ": sample at " << batch.x[i] << ", "
           << batch.y[i] << " is (" << radiance.r << ", " << radiance.g << ", " << radiance.b << "), interval";
      for (std::size_t c = 0; c < 3; ++c) text << " [" << intervals[i].low[c] << ", " << intervals[i].high[c] << "]";
      result.first = text.str();
    }
  }
  return result;
}

Comparison compare(const RandomScene& random, std::uint32_t per_pixel, std::uint64_t seed) {
  if (const auto issues = validate(random.scene, Limits{}); !issues.empty())
    throw std::runtime_error(issues[0].pointer + ": " + issues[0].detail);
  RenderControl control;
  const auto compiled = scenes::compiled(random.scene, random.assets);
  return compare(*compiled, intervals_of(*compiled, one_by_one, control), per_pixel, seed);
}

}  // namespace certify
