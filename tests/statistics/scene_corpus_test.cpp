// The corpus covers every feature of api/docs/scene.md.
#include "tests/statistics/scene_corpus.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/statistics/pixel_classes.h"
#include "tracer/requirements.h"
#include "tracer/validate.h"

namespace {

using namespace statistics;
using namespace tracer;

TEST(SceneCorpus, HasAtLeastFortyScenesWithUniqueNames) {
  std::set<std::string> names;
  for (const Case& scene : corpus()) names.insert(scene.name);
  EXPECT_EQ(names.size(), corpus().size());
  EXPECT_GE(corpus().size(), 40u);
}

TEST(SceneCorpus, HasValidScenesOfAFewThousandPixels) {
  for (const Case& scene : corpus()) {
    const auto issues = validate(scene.scene, Limits{});
    EXPECT_TRUE(issues.empty()) << scene.name << ": " << issues[0].pointer << ": " << issues[0].detail;
    EXPECT_GE(scene.scene.image.window().pixels(), 1500u) << scene.name;
    EXPECT_LE(scene.scene.image.window().pixels(), 3500u) << scene.name;
  }
}

TEST(SceneCorpus, HasEveryRequirement) {
  for (const RequirementName& requirement : requirement_names) {
    if (requirement.needed == &Requirements::approximations) continue;  // error estimates refer to the exact image
    bool needed = false;
    for (const Case& scene : corpus()) needed |= requirements(scene.scene).*requirement.needed;
    EXPECT_TRUE(needed) << requirement.name;
  }
}

/// Alternatives 0 .. count - 1 that no scene of the corpus has; `add` inserts those of one scene.
template <class Add>
std::set<std::size_t> missing(std::size_t count, const Add& add) {
  std::set<std::size_t> seen, result;
  for (const Case& scene : corpus()) add(scene.scene, seen);
  for (std::size_t i = 0; i < count; ++i)
    if (!seen.contains(i)) result.insert(i);
  return result;
}

template <class Enum>
std::size_t at(Enum value) {
  return static_cast<std::size_t>(value);
}

TEST(SceneCorpus, HasEveryShapeLightTextureMaterialCameraAndOverflow) {
  using Found = std::set<std::size_t>;
  const Found none;
  EXPECT_EQ(missing(std::variant_size_v<Shape>,
                    [](const Scene& scene, Found& seen) {
                      for (const Object& object : scene.objects) seen.insert(object.shape.index());
                    }),
            none);
  EXPECT_EQ(missing(std::variant_size_v<LightSource>,
                    [](const Scene& scene, Found& seen) {
                      for (const Light& light : scene.lights) seen.insert(light.source.index());
                    }),
            none);
  EXPECT_EQ(missing(3,
                    [](const Scene& scene, Found& seen) {
                      for (const Light& light : scene.lights) seen.insert(at(light.attenuation.kind));
                    }),
            none);
  EXPECT_EQ(missing(std::variant_size_v<decltype(Texture::pattern)>,
                    [](const Scene& scene, Found& seen) {
                      for (const Texture& texture : scene.textures) seen.insert(texture.pattern.index());
                    }),
            none);
  for (const auto& field :
       {+[](const Material& m) { return at(m.model); }, +[](const Material& m) { return at(m.transparency); }})
    EXPECT_EQ(missing(3,
                      [&](const Scene& scene, Found& seen) {
                        for (const Material& material : scene.materials) seen.insert(field(material));
                      }),
              none);
  EXPECT_EQ(missing(3, [](const Scene& scene, Found& seen) { seen.insert(at(scene.camera.type)); }), none);
  EXPECT_EQ(missing(3, [](const Scene& scene, Found& seen) { seen.insert(at(scene.output.overflow)); }), none);
}

TEST(SceneCorpus, HasPixelsOfEveryClass) {
  const auto count = [](std::string_view scene, PixelClass pixel_class) {
    const std::vector<PixelClass> pixel_classes = classify_pixels(*find(scene), 1);
    return std::count(pixel_classes.begin(), pixel_classes.end(), pixel_class);
  };
  EXPECT_GT(count("checker_nearest", PixelClass::edge), 400);
  EXPECT_EQ(count("checker_nearest", PixelClass::specular), 0);
  EXPECT_GT(count("mirrored_edges", PixelClass::specular), 400);
  EXPECT_GT(count("wide_penumbra", PixelClass::penumbra), 100);
  EXPECT_EQ(count("wide_penumbra", PixelClass::specular), 0);
  EXPECT_EQ(count("calm", PixelClass::smooth), 48 * 36);
  EXPECT_GT(count("lens", PixelClass::edge), count("depth_cue", PixelClass::specular));
}

}  // namespace
