/// Fields that name textures: environments, cubes, bumps and normal maps.

#include <gtest/gtest.h>

#include "tests/reader/reading.h"

namespace {

using reader_tests::accepted;
using reader_tests::document_with;
using reader_tests::file_bytes;
using reader_tests::outcome;
using Issues = std::vector<std::string>;

tracer::Scene scene_of(const std::string& file) {
  return accepted(file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/" + file)).scene;
}

TEST(SceneReader, ReadsEnvironmentsBeforeTheirTextures) {
  const tracer::Scene scene = scene_of("every_field_of_environments.json");
  ASSERT_TRUE(scene.background.environment);
  EXPECT_EQ(scene.background.environment->texture.index, 1u);
  EXPECT_EQ(scene.background.environment->rotation_deg, -30);
  EXPECT_EQ(scene.background.up, (tracer::Vec3{1, 0, 2}));
  EXPECT_FALSE(scene.background.gradient || scene.background.cube);
}

TEST(SceneReader, ReadsCubeFacesInAnyOrder) {
  const tracer::Scene scene = scene_of("every_field_of_cubes.json");
  ASSERT_TRUE(scene.background.cube);
  EXPECT_FALSE(scene.background.up) << "that of the camera";
  const auto& faces = scene.background.cube->faces;
  EXPECT_EQ(scene.textures[faces[0].index].path, "/background/cube/+x");
  for (std::uint32_t face = 1; face < 6; ++face) EXPECT_EQ(faces[face].index, face - 1) << "in the order of the faces";
}

TEST(SceneReader, ReadsBumpsAndNormalMaps) {
  const tracer::Scene scene = scene_of("every_field.json");
  const tracer::Material& glass = scene.materials[0];
  ASSERT_TRUE(glass.bump && glass.normal_map);
  EXPECT_EQ(scene.textures[glass.bump->texture.index].path, "/textures/marble");
  EXPECT_EQ(glass.bump->scale, -0.25);
  EXPECT_EQ(scene.textures[glass.normal_map->index].path, "/textures/oak");
}

TEST(DefaultValues, OfTexturesAreNoRotationUnitScaleAndNoBump) {
  const auto scene = accepted(document_with(R"("background": {"environment": {"checker": [0, 1]}},
                                               "materials": {"a": {"bump": {"texture": {"checker": [0, 1]}}}, "b": {}})"))
                         .scene;
  EXPECT_EQ(scene.background.environment->rotation_deg, 0);
  EXPECT_EQ(scene.materials[0].bump->scale, 1);
  EXPECT_FALSE(scene.materials[0].normal_map || scene.materials[1].bump || scene.materials[1].normal_map);
}

TEST(IssueSuppression, OmitsReferencesToInvalidTextures) {
  EXPECT_EQ(outcome(document_with(R"("textures": 3, "background": {"environment": "sky"},
                                     "materials": {"a": {"bump": {"texture": "dents"}, "normal_map": "dents"}})")),
            (Issues{"/textures wrong_type"}));
}

TEST(TextureReader, RejectsFilesWithoutAssets) {
  api::Limits limits;
  limits.files = api::Files::none;
  EXPECT_EQ(outcome(document_with(R"("background": {"environment": {"file": "sky.hdr"}})"), limits),
            (Issues{"/background/environment/file unsupported"}));
}

}  // namespace
