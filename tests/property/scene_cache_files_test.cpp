// Scene cache with files: which of them are read again, and that the images stay the same.
#include <gtest/gtest.h>

#include "tests/property/still_life.h"
#include "tracer/encode.h"
#include "tracer/requirements.h"

namespace {

using namespace still_life_tests;

/// As the document has it: its mesh is in a file.
Scene with_file(Scene scene, bool smooth = false) {
  scene.assets = {{"vase.ply", "/objects/0/file"}};
  Mesh unread;
  unread.file = AssetId{0};
  unread.smooth = smooth;
  scene.objects[0].shape = unread;
  return scene;
}

/// Reads the file, which has normals, as `whole`, if the scene still names it.
struct Frame {
  Compiled compiled;
  bool reads_file = false;
  Scene scene;
};
Frame frame(Scene unread, const Scene& whole, const std::string& content, SceneCache& cache) {
  RenderControl control;
  Frame frame;
  auto claim = *cache.acquire(unread, {content}, control);
  frame.reads_file = mesh_of(unread).file.has_value();
  if (frame.reads_file) unread.objects[0].shape = whole.objects[0].shape;
  frame.compiled = *compile_taking_meshes(unread, control, {}, claim.get());
  frame.scene = unread;
  return frame;
}

TEST(SceneCache, AvoidsReadingMeshFilesForFurtherFrames) {
  for (const bool file_has_normals : {true, false}) {
    SceneCache cache(plenty);
    Scene whole = still_life();
    mesh_of(whole).smooth = false;
    if (file_has_normals) mesh_of(whole).normals = mesh_of(whole).positions;
    EXPECT_TRUE(frame(with_file(whole), whole, "a", cache).reads_file);
    Scene moved = whole;
    moved.camera.position = {2, 2, 4};
    const Frame second = frame(with_file(moved), moved, "a", cache);
    EXPECT_FALSE(second.reads_file);
    EXPECT_TRUE(cache_hits(*second.compiled).geometry);
    RenderControl control;
    const Rendered with = *render(*second.compiled, {.threads = 1}, control);
    const Rendered without = scenes::render(moved);
    EXPECT_EQ(with.image.rgb, without.image.rgb) << file_has_normals;
    EXPECT_EQ(with.statistics, without.statistics) << file_has_normals;
    for (const RequirementName& each : requirement_names)
      EXPECT_EQ(requirements(second.scene).*each.needed, requirements(moved).*each.needed) << each.name;
  }
}

TEST(SceneCache, ReadsMeshFilesAgainIfTheyOrTheirTransformsChange) {
  SceneCache cache(plenty);
  const Scene whole = still_life();
  const auto reads = [&](const Scene& unread, const std::string& content) {
    return frame(unread, whole, content, cache).reads_file;
  };
  EXPECT_TRUE(reads(with_file(whole), "a"));
  EXPECT_FALSE(reads(with_file(whole), "a"));
  EXPECT_TRUE(reads(with_file(whole), "b"));
  EXPECT_TRUE(reads(with_file(whole, true), "a")) << "smooth";
  Scene turned = with_file(whole);
  turned.objects[0].transform = Transform{{{{0, 1, 0, 0}, {1, 0, 0, 0}, {0, 0, 1, 0}}}};
  EXPECT_TRUE(reads(turned, "a"));
  Scene clear = with_file(whole);
  clear.materials[0].transmission = 0.5;
  EXPECT_TRUE(reads(clear, "a"));
  EXPECT_FALSE(reads(with_file(whole), "b")) << "all of them are kept";
}

TEST(SceneCache, StoresNothingOfFilesWithUnknownContent) {
  SceneCache cache(plenty);
  const Scene whole = still_life();
  EXPECT_TRUE(frame(with_file(whole), whole, "", cache).reads_file);
  EXPECT_TRUE(frame(with_file(whole), whole, "", cache).reads_file);
  EXPECT_EQ(cache.memory_bytes().all(), 0u);
}

TEST(SceneCache, StoresNothingOfMeshesWithMaterialsForTheirParts) {
  SceneCache cache(plenty);
  const Scene whole = still_life();
  Scene parted = with_file(whole);
  mesh_of(parted).part_materials = {{"lid", parted.objects[0].material}};
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(frame(parted, whole, "a", cache).reads_file);
  EXPECT_EQ(cache.memory_bytes().geometry, 0u);
}

TEST(SceneCache, AvoidsReadingMeshFilesOfPrototypes) {
  SceneCache cache(plenty);
  Scene whole = still_life();
  whole.prototypes.push_back({{whole.objects[0]}, "/prototypes/vase"});
  const auto placed = [](double x) { return Transform{{{{1, 0, 0, x}, {0, 1, 0, 0}, {0, 0, 1, 0}}}}; };
  whole.objects[0] = {Instance{{0}, {}}, {}, placed(-1)};
  whole.objects.push_back({Instance{{0}, {}}, {}, placed(1)});
  Scene unread = whole;
  unread.assets = {{"vase.ply", "/prototypes/vase/0/file"}};
  Mesh of_file;
  of_file.file = AssetId{0};
  unread.prototypes[0].objects[0].shape = of_file;
  RenderControl control;
  {
    Scene first = unread;
    auto claim = *cache.acquire(first, {"a"}, control);
    ASSERT_TRUE(compile(whole, control, {}, claim.get()).has_value());
  }
  auto claim = *cache.acquire(unread, {"a"}, control);
  const Mesh& mesh = std::get<Mesh>(unread.prototypes[0].objects[0].shape);
  EXPECT_FALSE(mesh.file.has_value());
  EXPECT_TRUE(mesh.smooth) << "it has normals";
  const Rendered with = *render(**compile(unread, control, {}, claim.get()), {.threads = 1}, control);
  EXPECT_EQ(with.image.rgb, scenes::render(whole).image.rgb);
}

/// A floor with an image that is read as `space`.
Scene floor_with_image(std::optional<ColorSpace> space = {}) {
  Scene scene = scenes::empty(32, {{0, 1, 3}, {0, 0, 0}, {0, 1, 0}, 50});
  scene.lights = {scenes::point_light({1, 4, 2})};
  scene.assets = {{"tiles.png", "/textures/tiles/file"}};
  scene.textures = {{.pattern = ImageTexture{{0}, space}, .path = {}}};
  Material material = scenes::matte({1, 1, 1});
  material.color = TextureId{0};
  scenes::add(scene, Plane{}, material);
  return scene;
}

Assets image_file(std::uint32_t side, float light) {
  Image image{side, side, std::vector<float>(std::size_t{3} * side * side), {}, {}};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = light * static_cast<float>(i % 7) / 7;
  return {{encode(image, Format::png, {})->bytes}};
}

struct Images {
  std::uint32_t reused, decoded;
  bool operator==(const Images&) const = default;
};
Images images(Scene scene, const Assets& files, const std::string& content, SceneCache& cache) {
  RenderControl control;
  auto claim = *cache.acquire(scene, {content}, control);
  const Compiled compiled = *compile(scene, control, files, claim.get());
  EXPECT_EQ(render(*compiled, {.threads = 1}, control)->image.rgb, scenes::render(scene, 1, files).image.rgb);
  return {cache_hits(*compiled).textures, cache_hits(*compiled).decoded_textures};
}

TEST(SceneCache, DecodesAnImageOnceForEachColorSpace) {
  SceneCache cache(plenty);
  const Assets file = image_file(128, 1), other = image_file(128, 0.5f);
  EXPECT_EQ(images(floor_with_image(), file, "a", cache), (Images{0, 1}));
  EXPECT_EQ(cache.memory_bytes().geometry, 0u);
  EXPECT_GE(cache.memory_bytes().images, 128u * 128 * 3 * sizeof(float));
  EXPECT_EQ(images(floor_with_image(), file, "a", cache), (Images{1, 0}));
  EXPECT_EQ(images(floor_with_image(ColorSpace::linear), file, "a", cache), (Images{0, 1}));
  EXPECT_EQ(images(floor_with_image(ColorSpace::srgb), file, "a", cache), (Images{0, 1}));
  EXPECT_EQ(images(floor_with_image(), other, "b", cache), (Images{0, 1}));
  EXPECT_EQ(images(floor_with_image(), file, "a", cache), (Images{1, 0}));
  EXPECT_EQ(images(floor_with_image(), file, "", cache), (Images{0, 1})) << "its content is not known";
}

TEST(SceneCache, HasOneBudgetForImagesAndGeometry) {
  SceneCache measured(plenty);
  const Assets file = image_file(256, 1);
  images(floor_with_image(), file, "a", measured);
  const std::uint64_t image = measured.memory_bytes().images;
  reuses(still_life(), measured);
  const std::uint64_t geometry = measured.memory_bytes().geometry;
  SceneCache cache(image + geometry - 1);
  images(floor_with_image(), file, "a", cache);
  EXPECT_EQ(cache.memory_bytes().all(), image);
  reuses(still_life(), cache);
  EXPECT_EQ(cache.memory_bytes().images, 0u) << "used least lately";
  EXPECT_EQ(cache.memory_bytes().geometry, geometry);
  const Assets small = image_file(32, 1);
  EXPECT_EQ(images(floor_with_image(), small, "s", cache), (Images{0, 1}));
  EXPECT_EQ(images(floor_with_image(), small, "s", cache), (Images{0, 1})) << "decoded at once";
}

}  // namespace
