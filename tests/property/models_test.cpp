// Requirements select the integrator: both instantiations give the same image, and only required rays are traced.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/support/effort.h"
#include "tests/support/scenes.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace {

using namespace tracer;

Rendered rendered(const CompiledScene& scene) {
  RenderControl control;
  return *render(scene, {}, control);
}

/// Needs everything that can be modelled in vain; a lens, many lights and global light are other images.
void require_everything(CompiledScene& scene) {
  for (const RequirementName& name : requirement_names)
    if (name.needed != &Requirements::lens && name.needed != &Requirements::many_lights &&
        name.needed != &Requirements::global_light && name.needed != &Requirements::emitters)
      scene.needs.*name.needed = true;
}

/// Without textures, glass and light from behind: what the classic integrator takes, whatever else the scene has.
Scene simplified(Scene scene) {
  for (Material& material : scene.materials) {
    for (ColorOrTexture* color : {&material.color, &material.specular_color, &material.diffuse_transmission_color,
                                  &material.emission, &material.reflection_color, &material.transmission_color})
      if (std::holds_alternative<TextureId>(*color)) *color = Color{0.3, 0.5, 0.7};
    material.opacity = Color{1, 1, 1};
    material.transmission = material.diffuse_transmission = material.specular_transmission = 0;
  }
  return scene;
}

TEST(Integrator, OfAllFeaturesIsBitIdenticalToTheOneThatTheSceneRequires) {
  std::uint64_t classic = 0, full = 0;
  for (std::uint64_t seed = 0; seed < effort::cases(300); ++seed) {
    const Scene random = scenes::random(seed, 24);
    const Scene scene = seed % 2 == 0 ? random : simplified(random);
    const auto required = scenes::compiled(scene), everything = scenes::compiled(scene);
    // compile made it, and no one else looks at it.
    require_everything(const_cast<CompiledScene&>(*everything));
    ++(supports<WhittedFeatures>(required->needs) ? classic : full);
    ASSERT_FALSE(supports<WhittedFeatures>(everything->needs));
    const Rendered one = rendered(*required), other = rendered(*everything);
    ASSERT_EQ(one.image.rgb, other.image.rgb) << seed;
    ASSERT_EQ(one.statistics, other.statistics) << seed;
  }
  EXPECT_GT(classic, 0u);
  EXPECT_GT(full, 0u);
}

TEST(Integrator, IsTheClassicOneForWhittedsSceneWithoutItsTextureAndTheFullOneOtherwise) {
  Scene scene = scenes::empty(4);
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::glass());
  EXPECT_TRUE(supports<WhittedFeatures>(requirements(scene)));
  scene.output.alpha = true;
  EXPECT_FALSE(supports<WhittedFeatures>(requirements(scene)));
  scene.accuracy.model = Accuracy::Model::global;
  EXPECT_TRUE(supports<LocalFeatures>(requirements(scene))) << "nothing reflects light diffusely";
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::matte({1, 1, 1}));
  EXPECT_FALSE(supports<LocalFeatures>(requirements(scene)));
}

TEST(RequirementNames, AreComplete) {
  // A requirement without a name would be neither reported nor used to select the integrator.
  Requirements all;
  for (const RequirementName& name : requirement_names) all.*name.needed = true;
  const auto* bytes = reinterpret_cast<const unsigned char*>(&all);
  for (std::size_t i = 0; i < sizeof(Requirements); ++i) EXPECT_EQ(bytes[i], 1) << "member " << i;
}

/// The reasons of what a scene requires, by the name of the requirement.
std::map<std::string, std::string> reasons_of(const Scene& scene) {
  std::vector<RequirementReason> reasons;
  const Requirements needs = requirements(scene, &reasons);
  std::map<std::string, std::string> found;
  for (const RequirementName& name : requirement_names)
    for (const RequirementReason& reason : reasons)
      if (reason.needed == name.needed) {
        EXPECT_TRUE(needs.*name.needed);
        EXPECT_TRUE(found.emplace(name.name, reason.pointer).second);
      }
  return found;
}

TEST(RequirementReasons, NameTheFirstPartOfTheDocumentForEachRequirement) {
  Scene scene = scenes::empty(4);
  scene.lights = {scenes::point_light({0, 5, 0}), scenes::point_light({0, 5, 0})};
  scene.lights[0].shadows = false;
  Material mirror = scenes::mirror(0.5);
  mirror.diffuse = 1;
  mirror.path = "/materials/mirror";
  scenes::add(scene, Plane{{0, -1, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, mirror);
  EXPECT_EQ(reasons_of(scene), (std::map<std::string, std::string>{{"reflection", "/materials/mirror"},
                                                                   {"shadows", "/lights/1"},
                                                                   {"spheres", "/objects/1"},
                                                                   {"planes", "/objects/0"}}));
}

TEST(RequirementReasons, NameTheModelAndTheFirstFiniteEmitterForGlobalLight) {
  Scene scene = scenes::empty(4);
  Material sky = scenes::glowing({1, 1, 1}), lamp = sky;
  sky.path = "/materials/sky";
  lamp.path = "/materials/lamp";
  scenes::add(scene, Plane{{0, 9, 0}, {0, 1, 0}, {}}, sky);
  scenes::add(scene, Sphere{{0, 4, 0}, 1}, lamp);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  EXPECT_FALSE(requirements(scene).global_light || requirements(scene).emitters);
  scene.accuracy.model = Accuracy::Model::global;
  EXPECT_EQ(reasons_of(scene)["global_light"], "/accuracy/model");
  EXPECT_EQ(reasons_of(scene)["emitters"], "/materials/lamp");
}

TEST(RequirementReasons, NameTheApproximationThatAddsRequirements) {
  Scene scene = scenes::empty(4);
  scenes::add(scene, Sphere{}, scenes::matte({1, 1, 1}));
  scene.accuracy.approximate.shading = Approximations::Shading::gouraud;
  EXPECT_EQ(reasons_of(scene)["approximations"], "/accuracy/approximate");
  EXPECT_EQ(reasons_of(scene)["gouraud"], "/accuracy/approximate/shading");
}

}  // namespace
