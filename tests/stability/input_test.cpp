// Every number of a scene, set to NaN, infinite, huge or denormal: rejected with its pointer, or harmless.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "tests/stability/table.h"
#include "tracer/validate.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

/// A scene with every kind of element.
Scene scene_of_everything() {
  Scene scene = scenes::empty(4, {{1, 2, 9}, {0, 0.5, 0}, {0.1, 1, 0}, 40, Camera::Type::perspective, 3, 0.01, 8});
  scene.background.gradient = Gradient{{0.1, 0.2, 0.3}, {0.3, 0.2, 0.1}};
  scene.depth_cue = DepthCue{3, 20, 0.9, 0.2, {0.5, 0.5, 0.5}};
  scene.ambient = {0.1, 0.1, 0.1};
  scene.accuracy.max_depth = 4;
  for (const LightSource& source :
       {LightSource{PointLight{{1, 5, 3}}}, LightSource{DirectionalLight{{1, -2, -3}}},
        LightSource{SpotLight{{2, 5, 3}, {-2, -5, -3}, 10, 20}}, LightSource{LineLight{{0, 5, 0}, {1, 5, 1}}},
        LightSource{RectLight{{0, 6, 0}, {1, 0.1, 0}, {0, 0.1, 1}}}, LightSource{DiscLight{{3, 3, 3}, {0, -1, 0.1}, 1}},
        LightSource{SphereLight{{-3, 4, 3}, 1}}})
    scene.lights.push_back({source, {1, 0.9, 0.8}, 0.5, true, {Attenuation::Kind::polynomial, {1, 0.1, 0.01}}});
  const std::array<Color, 2> two{Color{0.2, 0.3, 0.4}, Color{0.9, 0.8, 0.7}};
  scene.textures = {{CheckerTexture{two}, {2, 3}, {0.1, 0.2}, "/textures/checker"},
                    {GradientTexture{two}, {2, 3}, {0.1, 0.2}, "/textures/gradient"},
                    {NoiseTexture{two, 3}, {2, 3}, {0.1, 0.2}, "/textures/noise"}};
  Material glass = scenes::glass();
  glass.model = Material::Model::blinn_phong;
  glass.diffuse = glass.specular = 0.3;
  glass.absorption = {0.1, 0.2, 0.3};
  glass.bump = Bump{{2}, 0.01};
  glass.path = "/materials/glass";
  scene.materials = {glass};
  for (std::uint32_t i = 0; i < 3; ++i) {
    Material matte = scenes::matte({});
    matte.color = TextureId{i};
    scene.materials.push_back(matte);
  }
  scenes::add(scene, Sphere{{0, 0.5, 0}, 0.5, {0, 1, 0.1}, {1, 0.1, 0}}, MaterialId{1});
  scenes::add(scene, Disc{{1, 1, 0}, {0, 0.1, 1}, 0.5, 0.1, Vec3{1, 0.1, 0}}, MaterialId{2});
  scenes::add(scene, Cylinder{{-1, 0, 0}, {-1, 1, 0.1}, 0.3, true, Vec3{1, 0.1, 0}}, MaterialId{0});
  scenes::add(scene, Torus{{-3, 1, 0}, {0, 0.1, 1}, 0.5, 0.2, Vec3{1, 0.1, 0}}, MaterialId{2});
  scenes::add(scene, Cone{{-2, 1, 0}, {-2, 0, 0.1}, 0.3, 0.1, true, Vec3{1, 0.1, 0}}, MaterialId{3});
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
  return scene;
}

/// The scene of everything, and a list of all its numbers with the pointers of their issues.
class Everything {
 public:
  struct Number {
    std::string pointer;
    double* value;
  };

  Everything() {
    add("/camera", scene.camera);
    add("/background", *scene.background.gradient);
    add("/background/up", scene.background.up);
    add("/depth_cue", scene.depth_cue);
    add("/medium", scene.medium);
    add("/ambient", scene.ambient);
    add("/accuracy/cutoff", *scene.accuracy.cutoff);
    add("/output", scene.output);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
      add("/lights/" + std::to_string(i), scene.lights[i].source);
      add("/lights/" + std::to_string(i), scene.lights[i]);
    }
    for (Texture& texture : scene.textures) {
      add(texture.path, texture.pattern);
      add(texture.path, texture);
    }
    add("/materials/glass", scene.materials[0]);
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      const std::string at = "/objects/" + std::to_string(i);
      add(at, scene.objects[i].shape);
      if (auto& transform = scene.objects[i].transform)
        for (auto& row : transform->rows)
          for (double& entry : row) add(at + "/transform", entry);
    }
  }
  Everything(const Everything&) = delete;
  Everything& operator=(const Everything&) = delete;

  Scene scene = scene_of_everything();
  std::vector<Number> numbers;

 private:
  /// All numbers of a value, those of a part of the scene by its table of fields.
  template <class T>
  void add(const std::string& at, T& value) {
    if constexpr (std::is_same_v<T, double>) {
      numbers.push_back({at, &value});
    } else if constexpr (std::is_same_v<T, Color>) {
      for (double* channel : {&value.r, &value.g, &value.b}) add(at, *channel);
    } else if constexpr (std::is_same_v<T, Vec2> || std::is_same_v<T, Vec3>) {
      add(at + "/0", value.x);
      add(at + "/1", value.y);
      if constexpr (std::is_same_v<T, Vec3>) add(at + "/2", value.z);
    } else if constexpr (std::is_same_v<T, Gradient>) {
      add(at + "/zenith", value.zenith);
      add(at + "/nadir", value.nadir);
    } else if constexpr (std::is_same_v<T, Attenuation>) {
      add(at, value.coefficients);
    } else if constexpr (std::is_same_v<T, Mesh>) {
      for (std::size_t i = 0; i < value.positions.size(); ++i) {
        add(at + "/positions/" + std::to_string(i), value.positions[i]);
        add(at + "/normals/" + std::to_string(i), value.normals[i]);
        add(at + "/uvs/" + std::to_string(i), value.uvs[i]);
      }
    } else if constexpr (HasFields<T>) {
      for_each_field<T>([&](const auto& field) { add(at + "/" + std::string(field.name), value.*field.member); });
    }
  }
  template <class T>
  void add(const std::string& at, std::optional<T>& value) {
    if (value) add(at, *value);
  }
  template <class T, std::size_t count>
  void add(const std::string& at, std::array<T, count>& values) {
    for (std::size_t i = 0; i < count; ++i) add(at + "/" + std::to_string(i), values[i]);
  }
  template <class... Kinds>
  void add(const std::string& at, std::variant<Kinds...>& any) {
    std::visit([&](auto& one) { add(at, one); }, any);
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
