// Every number of a scene, set to NaN, infinite, huge or denormal: rejected with its pointer, or harmless.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "tests/stability/table.h"
#include "tracer/validate.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

/// A scene with every kind of element, and a list of all its numbers with the pointers of their issues.
class Everything {
 public:
  struct Number {
    std::string pointer;
    double* value;
  };

  Everything() {
    camera_and_world();
    add_lights();
    materials();
    round_shapes();
    flat_shapes();
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      const std::string at = "/objects/" + std::to_string(i);
      add_fields(at, scene.objects[i].shape);
      if (auto& transform = scene.objects[i].transform)
        for (auto& row : transform->rows)
          for (double& entry : row) number(at + "/transform", entry);
    }
    number("/accuracy/cutoff", scene.accuracy.cutoff);
    number("/output/exposure", scene.output.exposure);
  }
  Everything(const Everything&) = delete;
  Everything& operator=(const Everything&) = delete;

  Scene scene = scenes::empty(4);
  std::vector<Number> numbers;

 private:
  void number(const std::string& pointer, double& value) { numbers.push_back({pointer, &value}); }
  void color(const std::string& pointer, Color& c) {
    for (double* channel : {&c.r, &c.g, &c.b}) number(pointer, *channel);
  }

  void add(const std::string& /*pointer*/, bool& /*flag*/) {}
  void add(const std::string& pointer, double& value) { number(pointer, value); }
  void add(const std::string& pointer, Vec3& v) { add_list(pointer, std::array{&v.x, &v.y, &v.z}); }
  void add(const std::string& pointer, Vec2& v) { add_list(pointer, std::array{&v.x, &v.y}); }
  template <class T>
  void add(const std::string& pointer, std::optional<T>& value) {
    add(pointer, value.value());
  }
  template <class T, std::size_t count>
  void add(const std::string& pointer, std::array<T, count>& values) {
    for (std::size_t i = 0; i < count; ++i) add(pointer + "/" + std::to_string(i), values[i]);
  }
  template <std::size_t count>
  void add_list(const std::string& pointer, const std::array<double*, count>& values) {
    for (std::size_t i = 0; i < count; ++i) number(pointer + "/" + std::to_string(i), *values[i]);
  }
  /// All fields of a shape or a light.
  template <class... Kinds>
  void add_fields(const std::string& at, std::variant<Kinds...>& any) {
    std::visit(
        [&]<class Kind>(Kind& one) {
          if constexpr (HasFields<Kind>)
            for_each_field<Kind>(
                [&](const auto& field) { add(at + "/" + std::string(field.name), one.*field.member); });
        },
        any);
  }

  void camera_and_world() {
    Camera& camera = scene.camera;
    camera = {{1, 2, 9}, {0, 0.5, 0}, {0.1, 1, 0}, 40, Camera::Type::perspective, 3, 0.01, 8};
    add("/camera/position", camera.position);
    add("/camera/look_at", camera.look_at);
    add("/camera/up", camera.up);
    number("/camera/fov", camera.fov_deg);
    number("/camera/height", camera.height);
    number("/camera/aperture", camera.aperture);
    number("/camera/focus_distance", *camera.focus_distance);
    scene.background.gradient = Gradient{{0.1, 0.2, 0.3}, {0.3, 0.2, 0.1}};
    add("/background/up", *scene.background.up);
    color("/background/zenith", scene.background.gradient->zenith);
    color("/background/nadir", scene.background.gradient->nadir);
    scene.depth_cue = DepthCue{3, 20, 0.9, 0.2, {0.5, 0.5, 0.5}};
    number("/depth_cue/front", scene.depth_cue->front);
    number("/depth_cue/back", scene.depth_cue->back);
    number("/depth_cue/front_scale", scene.depth_cue->front_scale);
    number("/depth_cue/back_scale", scene.depth_cue->back_scale);
    color("/depth_cue/color", scene.depth_cue->color);
    scene.ambient = {0.1, 0.1, 0.1};
    color("/ambient", scene.ambient);
    scene.accuracy.max_depth = 4;
  }

  void add_lights() {
    for (const LightSource& source :
         {LightSource{PointLight{{1, 5, 3}}}, LightSource{DirectionalLight{{1, -2, -3}}},
          LightSource{SpotLight{{2, 5, 3}, {-2, -5, -3}, 10, 20}}, LightSource{LineLight{{0, 5, 0}, {1, 5, 1}}},
          LightSource{RectLight{{0, 6, 0}, {1, 0.1, 0}, {0, 0.1, 1}}},
          LightSource{DiscLight{{3, 3, 3}, {0, -1, 0.1}, 1}}, LightSource{SphereLight{{-3, 4, 3}, 1}}})
      scene.lights.push_back({source, {1, 0.9, 0.8}, 0.5, true, {Attenuation::Kind::polynomial, {1, 0.1, 0.01}}});
    const auto at = [](std::size_t i, const char* field) { return "/lights/" + std::to_string(i) + "/" + field; };
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
      add_fields("/lights/" + std::to_string(i), scene.lights[i].source);
      color(at(i, "color"), scene.lights[i].color);
      number(at(i, "intensity"), scene.lights[i].intensity);
      for (std::size_t c = 0; c < 3; ++c)
        number(at(i, "attenuation/") + std::to_string(c), scene.lights[i].attenuation.coefficients[c]);
    }
  }

  void materials() {
    const std::array<Color, 2> two{Color{0.2, 0.3, 0.4}, Color{0.9, 0.8, 0.7}};
    scene.textures = {{CheckerTexture{two}, {2, 3}, {0.1, 0.2}, "/textures/checker"},
                      {GradientTexture{two}, {2, 3}, {0.1, 0.2}, "/textures/gradient"},
                      {NoiseTexture{two, 3}, {2, 3}, {0.1, 0.2}, "/textures/noise"}};
    color("/textures/checker/checker/0", std::get<CheckerTexture>(scene.textures[0].pattern).colors[0]);
    color("/textures/gradient/gradient/1", std::get<GradientTexture>(scene.textures[1].pattern).colors[1]);
    color("/textures/noise/noise/1", std::get<NoiseTexture>(scene.textures[2].pattern).colors[1]);
    for (Texture& texture : scene.textures) {
      add(texture.path + "/scale", texture.scale);
      add(texture.path + "/offset", texture.offset);
    }
    Material glass = scenes::glass();
    glass.model = Material::Model::blinn_phong;
    glass.diffuse = glass.specular = 0.3;
    glass.absorption = {0.1, 0.2, 0.3};
    glass.path = "/materials/glass";
    scene.materials = {glass};
    for (std::uint32_t i = 0; i < 3; ++i) {
      Material matte = scenes::matte({});
      matte.color = TextureId{i};
      scene.materials.push_back(matte);
    }
    Material& m = scene.materials[0];
    color("/materials/glass/color", std::get<Color>(m.color));
    color("/materials/glass/specular_color", std::get<Color>(m.specular_color));
    color("/materials/glass/emission", std::get<Color>(m.emission));
    color("/materials/glass/reflection_color", std::get<Color>(m.reflection_color));
    color("/materials/glass/transmission_color", std::get<Color>(m.transmission_color));
    color("/materials/glass/absorption", m.absorption);
    number("/materials/glass/ambient", m.ambient);
    number("/materials/glass/diffuse", m.diffuse);
    number("/materials/glass/specular", m.specular);
    number("/materials/glass/shininess", m.shininess);
    number("/materials/glass/reflection", m.reflection);
    number("/materials/glass/transmission", m.transmission);
    number("/materials/glass/ior", m.ior);
  }

  void round_shapes() {
    scenes::add(scene, Sphere{{0, 0.5, 0}, 0.5, {0, 1, 0.1}, {1, 0.1, 0}}, MaterialId{1});
    scenes::add(scene, Disc{{1, 1, 0}, {0, 0.1, 1}, 0.5, 0.1, Vec3{1, 0.1, 0}}, MaterialId{2});
    scenes::add(scene, Cylinder{{-1, 0, 0}, {-1, 1, 0.1}, 0.3, true, Vec3{1, 0.1, 0}}, MaterialId{0});
    scenes::add(scene, Torus{{-3, 1, 0}, {0, 0.1, 1}, 0.5, 0.2, Vec3{1, 0.1, 0}}, MaterialId{2});
    scenes::add(scene, Cone{{-2, 1, 0}, {-2, 0, 0.1}, 0.3, 0.1, true, Vec3{1, 0.1, 0}}, MaterialId{3});
  }
  void flat_shapes() {
    scenes::add(scene, Plane{{0, -0.5, 0}, {0, 1, 0.1}, Vec3{1, 0.1, 0}}, MaterialId{1});
    scenes::add(scene, Box{{1, 0, 1}, {1.5, 0.5, 1.5}}, MaterialId{0});
    const std::array<Vec3, 3> up{Vec3{0, 0.1, 1}, Vec3{0.1, 0, 1}, Vec3{0, 0, 1}};
    scenes::add(scene,
                Triangle{{{{-1, 0, 1}, {0, 0, 1}, {-0.5, 1, 1}}}, up, std::array<Vec2, 3>{Vec2{0, 0}, {1, 0}, {0, 1}}},
                MaterialId{2});
    scenes::add(
        scene,
        Mesh{{{0, 1, 1}, {1, 1, 1}, {0, 2, 1}}, {{0, 1, 2}}, {up[0], up[1], up[2]}, {{0, 0}, {1, 0}, {0, 1}}, false},
        MaterialId{1});
    for (std::size_t i = 0; i < scene.objects.size(); i += 3) scene.objects[i].transform = Transform{};
    auto& mesh = std::get<Mesh>(scene.objects.back().shape);
    const std::string at = "/objects/" + std::to_string(scene.objects.size() - 1) + "/";
    for (std::size_t i = 0; i < 3; ++i) {
      add(at + "positions/" + std::to_string(i), mesh.positions[i]);
      add(at + "normals/" + std::to_string(i), mesh.normals[i]);
      add(at + "uvs/" + std::to_string(i), mesh.uvs[i]);
    }
  }
};

/// True if one pointer is a prefix of the other: an issue may refer to the field, its parent or its part.
bool names(const Issue& issue, const std::string& pointer) {
  return issue.pointer.starts_with(pointer) || pointer.starts_with(issue.pointer + "/");
}

TEST(SceneNumbers, ThatAreNotFiniteAreRejectedWithTheirPointer) {
  Row row(19, "NaN, inf, -inf in every number of a scene: refused by name", Oracle::closed_form, "numbers");
  Everything everything;
  ASSERT_EQ(validate(everything.scene, {}), std::vector<Issue>{});
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const auto& [pointer, value] : everything.numbers)
    for (const double bad : {std::nan(""), infinity, -infinity}) {
      const double kept = std::exchange(*value, bad);
      bool reported = false;
      for (const Issue& issue : validate(everything.scene, {}))
        reported |= issue.pointer == pointer && issue.code == "not_finite";
      row.expect(reported, pointer + " = " + std::to_string(bad));
      *value = kept;
    }
}

TEST(SceneNumbers, ThatAreHugeOrDenormalAreRejectedOrHarmless) {
  Row huge(19, "1e308, -1e308 in every number: refused by name", Oracle::closed_form, "numbers");
  Row denormal(19, "5e-324, -0.0 in every number: refused by name, or a finite image", Oracle::conservation, "numbers");
  huge.note("shininess has no upper bound");
  Everything everything;
  for (const auto& [pointer, value] : everything.numbers)
    for (const double bad : {1e308, -1e308, 5e-324, -0.0}) {
      if (pointer == "/materials/glass/shininess" && bad == 1e308) continue;
      const double kept = std::exchange(*value, bad);
      const std::vector<Issue> issues = validate(everything.scene, {});
      bool reported = false;
      for (const Issue& issue : issues) reported |= names(issue, pointer);
      const std::string what = pointer + " = " + std::to_string(bad);
      if (std::abs(bad) > 1) {
        huge.expect(reported, what);
      } else if (!issues.empty()) {
        denormal.expect(reported, what);
      } else {
        const Rendered rendered = stability::render(everything.scene);
        bool finite = rendered.statistics.non_finite == 0;
        for (const float channel : rendered.image.rgb) finite &= std::isfinite(channel);
        denormal.expect(finite, what);
      }
      *value = kept;
    }
}

}  // namespace
