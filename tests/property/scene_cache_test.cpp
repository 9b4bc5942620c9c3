// Geometry and pictures kept between scenes: who shares them, who must not, and what threads, cancels and budgets do to
// them.
#include "tracer/scene_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <thread>

#include "tests/support/scenes.h"
#include "tracer/encode.h"
#include "tracer/requirements.h"
#include "tracer/src/cache/digest.h"

namespace {

using namespace tracer;

constexpr std::uint64_t plenty = 1u << 30;

using Compiled = std::shared_ptr<const CompiledScene>;

/// Of a scene without files; null where it was cancelled.
Compiled compiled(Scene scene, SceneCache* cache, RenderControl& control) {
  std::shared_ptr<SceneClaim> claim;
  if (cache != nullptr) {
    auto claimed = cache->claim(scene, {}, control);
    if (!claimed) return nullptr;
    claim = *std::move(claimed);
  }
  auto result = compile(scene, control, {}, claim.get());
  return result ? *result : nullptr;
}

Compiled compiled(const Scene& scene, SceneCache* cache) {
  RenderControl control;
  Compiled result = compiled(scene, cache, control);
  EXPECT_NE(result, nullptr);
  return result;
}

bool reuses(const Scene& scene, SceneCache& cache) { return reuse(*compiled(scene, &cache)).geometry; }

/// A mesh, glass, quadrics, loose triangles and a plane: something of everything.
Scene still_life(double size = 1) {
  Scene scene = scenes::empty(40);
  scene.camera = {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 40};
  scene.lights = {scenes::point_light({3, 5, 4})};
  scenes::add(scene, scenes::placed(scenes::icosphere(4, true), size, {-0.5, 0, 0}), scenes::matte({0.8, 0.5, 0.2}));
  scenes::add(scene, Sphere{{0.9, 0, 0.5}, 0.5}, scenes::glass());
  scenes::add(scene, Cylinder{{1, -1, -1}, {1, 1, -1}, 0.3, true, {}}, scenes::mirror());
  scenes::add(scene, Cone{}, scenes::matte({0.1, 0.4, 0.9}));
  scenes::add(scene, Triangle{{Vec3{-2, -1, 0}, Vec3{-1, -1, 1}, Vec3{-2, 1, 0}}, {}, {}}, scenes::mirror(0.5));
  scenes::add(scene, Plane{{0, -1, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  scene.accuracy.max_depth = 4;
  return scene;
}

struct Change {
  const char* name;
  std::function<void(Scene&)> make;
};

TEST(SceneCache, ServesScenesThatDifferInAllButShapesWithThePictureTheyHaveWithoutIt) {
  const std::vector<Change> changes = {
      {"nothing", [](Scene&) {}},
      {"camera",
       [](Scene& s) {
         s.camera.position = {2, 2, 4};
       }},
      {"image",
       [](Scene& s) {
         s.image = {31, 17, {}};
       }},
      {"light",
       [](Scene& s) {
         s.lights.push_back(scenes::directional_light({0, -1, -1}));
       }},
      {"background",
       [](Scene& s) {
         s.background.color = {0.1, 0.2, 0.7};
       }},
      {"accuracy", [](Scene& s) { s.accuracy.samples = 3; }},
      {"color",
       [](Scene& s) {
         s.materials[0].color = Color{0, 1, 0};
       }},
      {"texture",
       [](Scene& s) {
         s.textures.push_back({CheckerTexture{{Color{1, 0, 0}, Color{0, 0, 1}}}, {9, 9}, {}, {}, {}, {}});
         s.materials[0].color = TextureId{0};
       }},
      {"flat shading", [](Scene& s) { s.materials[0].shading = Material::Shading::flat; }},
  };
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(still_life(), cache)) << "the first must build";
  for (const Change& change : changes) {
    Scene scene = still_life();
    change.make(scene);
    const Compiled shared = compiled(scene, &cache);
    EXPECT_TRUE(reuse(*shared).geometry) << change.name;
    RenderControl control;
    const Rendered with = *render(*shared, {.threads = 1}, control);
    const Rendered without = scenes::render(scene);
    EXPECT_EQ(with.image.rgb, without.image.rgb) << change.name;
    EXPECT_EQ(with.statistics, without.statistics) << change.name;
    EXPECT_EQ(memory_bytes(*shared), memory_bytes(*compiled(scene, nullptr))) << change.name;
  }
}

Mesh& mesh_of(Scene& scene) { return std::get<Mesh>(scene.objects[0].shape); }

TEST(SceneCache, BuildsAgainWhereARayCouldTell) {
  const std::vector<Change> changes = {
      {"a vertex, by its last bit",
       [](Scene& s) {
         double& x = mesh_of(s).positions[77].x;
         x = std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) ^ 1u);
       }},
      {"a triangle's corners", [](Scene& s) { std::swap(mesh_of(s).triangles[5][0], mesh_of(s).triangles[5][1]); }},
      {"normals", [](Scene& s) { mesh_of(s).smooth = false; }},
      {"texture coordinates", [](Scene& s) { mesh_of(s).uvs.resize(mesh_of(s).positions.size()); }},
      {"a sphere", [](Scene& s) { std::get<Sphere>(s.objects[1].shape).radius = 0.625; }},
      {"a cylinder's caps", [](Scene& s) { std::get<Cylinder>(s.objects[2].shape).caps = false; }},
      {"a cone", [](Scene& s) { std::get<Cone>(s.objects[3].shape).apex_radius = 0.125; }},
      {"a loose triangle", [](Scene& s) { std::get<Triangle>(s.objects[4].shape).vertices[0].z = 0.125; }},
      {"a plane", [](Scene& s) { std::get<Plane>(s.objects[5].shape).point.y = -1.5; }},
      {"what is transmissive", [](Scene& s) { s.materials[0].transmission = 0.5; }},
      {"an instance more",
       [](Scene& s) {
         s.prototypes.push_back({{{Sphere{}, {0}, {}}}, "/prototypes/ball"});
         s.objects.push_back({Instance{{0}, {}}, {}, {}});
       }},
      {"one object less", [](Scene& s) { s.objects.erase(s.objects.begin() + 4); }},
      {"the frame",
       [](Scene& s) {
         scenes::add(s, Sphere{{40, 0, 0}, 1}, scenes::mirror());
       }},
      {"a transform",
       [](Scene& s) {
         s.objects[0].transform = Transform{{{{1, 0, 0, 0.5}, {0, 1, 0, 0}, {0, 0, 1, 0}}}};
       }},
  };
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(still_life(), cache));
  for (const Change& change : changes) {
    Scene scene = still_life();
    change.make(scene);
    EXPECT_FALSE(reuses(scene, cache)) << change.name;
    EXPECT_TRUE(reuses(scene, cache)) << change.name << ", once more";
  }
}

TEST(SceneCache, KeepsWithinItsBudgetWhatWasUsedLast) {
  SceneCache big(plenty);
  reuses(still_life(), big);
  const std::uint64_t each = big.memory_bytes().all();
  ASSERT_GT(each, SceneCache::worthwhile_bytes);

  SceneCache cache(2 * each + each / 2);
  const Scene a = still_life(1), b = still_life(0.5), c = still_life(0.25);
  EXPECT_FALSE(reuses(a, cache));
  EXPECT_FALSE(reuses(b, cache));
  EXPECT_TRUE(reuses(a, cache));
  EXPECT_FALSE(reuses(c, cache)) << "and b, used least lately, goes";
  EXPECT_LE(cache.memory_bytes().all(), 2 * each + each / 2);
  EXPECT_TRUE(reuses(a, cache));
  EXPECT_TRUE(reuses(c, cache));
  EXPECT_FALSE(reuses(b, cache));
}

TEST(SceneCache, KeepsNeitherWhatIsLargerThanItsBudgetNorWhatIsBuiltAtOnce) {
  SceneCache none(0);
  EXPECT_FALSE(reuses(still_life(), none));
  EXPECT_FALSE(reuses(still_life(), none));
  EXPECT_EQ(none.memory_bytes().all(), 0u);

  Scene small = scenes::empty(8);
  scenes::add(small, Sphere{}, scenes::mirror());
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(small, cache));
  EXPECT_FALSE(reuses(small, cache));
  EXPECT_EQ(cache.memory_bytes().all(), 0u);
}

TEST(SceneCache, ClearedKeepsNothingAndWhatWasCompiledStays) {
  auto cache = std::make_unique<SceneCache>(plenty);
  const Compiled scene = compiled(still_life(), cache.get());
  cache->clear();
  EXPECT_EQ(cache->memory_bytes().all(), 0u);
  EXPECT_FALSE(reuses(still_life(), *cache));
  cache.reset();
  RenderControl control;
  EXPECT_EQ(render(*scene, {.threads = 1}, control)->image.rgb, scenes::render(still_life()).image.rgb);
}

TEST(SceneCache, HasOneOfManyAtOnceBuild) {
  SceneCache cache(plenty);
  const Scene scene = still_life();
  std::vector<Compiled> results(8);
  std::vector<std::thread> threads;
  for (Compiled& result : results) threads.emplace_back([&] { result = compiled(scene, &cache); });
  for (std::thread& thread : threads) thread.join();
  const auto built = [](const Compiled& result) { return !reuse(*result).geometry; };
  EXPECT_EQ(std::count_if(results.begin(), results.end(), built), 1);
}

/// Whoever builds is among those that are cancelled at any moment.
TEST(SceneCache, DoesNotTakeOthersAlongWhenOneIsCancelled) {
  const Scene scene = still_life();
  int cancelled = 0;
  for (int round = 0; round < 40; ++round) {
    SceneCache cache(plenty);
    RenderControl given_up;
    Compiled wanted;
    std::thread first([&] { cancelled += compiled(scene, &cache, given_up) ? 0 : 1; });
    std::thread second([&] { wanted = compiled(scene, &cache); });
    std::thread someone([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(100 * round));
      given_up.cancel();
    });
    for (std::thread* thread : {&first, &second, &someone}) thread->join();
    ASSERT_NE(wanted, nullptr);
    EXPECT_TRUE(reuses(scene, cache)) << "what it built is kept";
  }
  EXPECT_GT(cancelled, 0) << "the first round cancels at once";
}

/// As the document has it: its mesh is in a file.
Scene with_file(Scene scene, bool smooth = false) {
  scene.assets = {{"vase.ply", "/objects/0/file"}};
  Mesh unread;
  unread.file = AssetId{0};
  unread.smooth = smooth;
  scene.objects[0].shape = unread;
  return scene;
}

/// Reads the file, which has normals, as `whole`, where it is asked for.
struct Frame {
  Compiled compiled;
  bool reads_file = false;
  Scene scene;
};
Frame frame(Scene unread, const Scene& whole, const std::string& content, SceneCache& cache) {
  RenderControl control;
  Frame frame;
  auto claim = *cache.claim(unread, {content}, control);
  frame.reads_file = mesh_of(unread).file.has_value();
  if (frame.reads_file) unread.objects[0].shape = whole.objects[0].shape;
  frame.compiled = *compile_taking_meshes(unread, control, {}, claim.get());
  frame.scene = unread;
  return frame;
}

TEST(SceneCache, SparesFramesTheReadingOfMeshFilesAndTheirPicturesAreTheSame) {
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
    EXPECT_TRUE(reuse(*second.compiled).geometry);
    RenderControl control;
    const Rendered with = *render(*second.compiled, {.threads = 1}, control);
    const Rendered without = scenes::render(moved);
    EXPECT_EQ(with.image.rgb, without.image.rgb) << file_has_normals;
    EXPECT_EQ(with.statistics, without.statistics) << file_has_normals;
    for (const RequirementName& each : requirement_names)
      EXPECT_EQ(requirements(second.scene).*each.needed, requirements(moved).*each.needed) << each.name;
  }
}

TEST(SceneCache, ReadsMeshFilesAgainWhereTheyOrTheirPlacesAreOthers) {
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

TEST(SceneCache, KeepsNothingOfFilesWhoseContentIsNotKnown) {
  SceneCache cache(plenty);
  const Scene whole = still_life();
  EXPECT_TRUE(frame(with_file(whole), whole, "", cache).reads_file);
  EXPECT_TRUE(frame(with_file(whole), whole, "", cache).reads_file);
  EXPECT_EQ(cache.memory_bytes().all(), 0u);
}

TEST(SceneCache, SparesMeshesThatInstancesPlaceTheReadingOfTheirFiles) {
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
    auto claim = *cache.claim(first, {"a"}, control);
    ASSERT_TRUE(compile(whole, control, {}, claim.get()).has_value());
  }
  auto claim = *cache.claim(unread, {"a"}, control);
  const Mesh& mesh = std::get<Mesh>(unread.prototypes[0].objects[0].shape);
  EXPECT_FALSE(mesh.file.has_value());
  EXPECT_TRUE(mesh.smooth) << "it has normals";
  const Rendered with = *render(**compile(unread, control, {}, claim.get()), {.threads = 1}, control);
  EXPECT_EQ(with.image.rgb, scenes::render(whole).image.rgb);
}

/// A floor with a picture that is read as `space`.
Scene floor_with_picture(std::optional<ColorSpace> space = {}) {
  Scene scene = scenes::empty(32);
  scene.camera = {{0, 1, 3}, {0, 0, 0}, {0, 1, 0}, 50};
  scene.lights = {scenes::point_light({1, 4, 2})};
  scene.assets = {{"tiles.png", "/textures/tiles/file"}};
  Texture texture;
  texture.pattern = ImageTexture{{0}, space};
  scene.textures = {texture};
  Material material = scenes::matte({1, 1, 1});
  material.color = TextureId{0};
  scenes::add(scene, Plane{}, material);
  return scene;
}

Assets picture_file(std::uint32_t side, float light) {
  Image image{side, side, std::vector<float>(std::size_t{3} * side * side), {}, {}};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = light * static_cast<float>(i % 7) / 7;
  return {{*encode(image, Format::png, {})}};
}

struct Pictures {
  std::uint32_t reused, decoded;
  bool operator==(const Pictures&) const = default;
};
Pictures pictures(Scene scene, const Assets& files, const std::string& content, SceneCache& cache) {
  RenderControl control;
  auto claim = *cache.claim(scene, {content}, control);
  const Compiled compiled = *compile(scene, control, files, claim.get());
  EXPECT_EQ(render(*compiled, {.threads = 1}, control)->image.rgb, scenes::render(scene, 1, files).image.rgb);
  return {reuse(*compiled).pictures, reuse(*compiled).decoded_pictures};
}

TEST(SceneCache, DecodesAPictureOnceForEachColorSpace) {
  SceneCache cache(plenty);
  const Assets file = picture_file(128, 1), other = picture_file(128, 0.5f);
  EXPECT_EQ(pictures(floor_with_picture(), file, "a", cache), (Pictures{0, 1}));
  EXPECT_EQ(cache.memory_bytes().geometry, 0u);
  EXPECT_GE(cache.memory_bytes().pictures, 128u * 128 * 3 * sizeof(float));
  EXPECT_EQ(pictures(floor_with_picture(), file, "a", cache), (Pictures{1, 0}));
  EXPECT_EQ(pictures(floor_with_picture(ColorSpace::linear), file, "a", cache), (Pictures{0, 1}));
  EXPECT_EQ(pictures(floor_with_picture(ColorSpace::srgb), file, "a", cache), (Pictures{0, 1}));
  EXPECT_EQ(pictures(floor_with_picture(), other, "b", cache), (Pictures{0, 1}));
  EXPECT_EQ(pictures(floor_with_picture(), file, "a", cache), (Pictures{1, 0}));
  EXPECT_EQ(pictures(floor_with_picture(), file, "", cache), (Pictures{0, 1})) << "its content is not known";
}

TEST(SceneCache, HoldsPicturesAndGeometryToOneBudget) {
  SceneCache measured(plenty);
  const Assets file = picture_file(256, 1);
  pictures(floor_with_picture(), file, "a", measured);
  const std::uint64_t picture = measured.memory_bytes().pictures;
  reuses(still_life(), measured);
  const std::uint64_t geometry = measured.memory_bytes().geometry;
  SceneCache cache(picture + geometry - 1);
  pictures(floor_with_picture(), file, "a", cache);
  EXPECT_EQ(cache.memory_bytes().all(), picture);
  reuses(still_life(), cache);
  EXPECT_EQ(cache.memory_bytes().pictures, 0u) << "used least lately";
  EXPECT_EQ(cache.memory_bytes().geometry, geometry);
  const Assets small = picture_file(32, 1);
  EXPECT_EQ(pictures(floor_with_picture(), small, "s", cache), (Pictures{0, 1}));
  EXPECT_EQ(pictures(floor_with_picture(), small, "s", cache), (Pictures{0, 1})) << "decoded at once";
}

std::string hex(std::string_view bytes) {
  std::string text;
  for (const unsigned char byte : bytes) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

/// hashlib.blake2b(bytes, digest_size=32) of Python 3.11, of the bytes 0, 1, ... 250, 0, 1 ... around a block's length.
TEST(Digest, IsBlake2b) {
  const std::pair<std::size_t, const char*> expected[] = {
      {0, "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8"},
      {3, "3d8c3d594928271f44aad7a04b177154806867bcf918e1549c0bc16f9da2b09b"},
      {127, "f2fe67ff342e21b8f45e8f2e0bcd1d9243245d50ee6c78042e9c491388791c72"},
      {128, "c3582f71ebb2be66fa5dd750f80baae97554f3b015663c8be377cfcb2488c1d1"},
      {129, "f7f3c46ba2564ff4c4c162da1f5b605f9f1c4aa6a20652a9f9a337c1a2f5b9c9"},
      {256, "582f782226018ec33076bd8d1c42413530ac7e1126260ffc0f306ba3befc3f24"},
      {257, "227e15ed64ee8e93eb7bc53828f76eed974f2c4ab1408c3d08f212b7f8d69904"},
      {1000, "b372d0608f720c8c3dd41e9c8eecb10143b41abe520b616607e754bf79c08331"},
  };
  for (const auto& [count, digest] : expected) {
    std::string bytes(count, '\0');
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<char>(i % 251);
    Digest whole, parts;
    whole.add(bytes.data(), count);
    for (std::size_t at = 0; at < count; at += 7) parts.add(bytes.data() + at, std::min<std::size_t>(7, count - at));
    EXPECT_EQ(whole.bytes(), count);
    EXPECT_EQ(hex(whole.end()), digest) << count << " bytes";
    EXPECT_EQ(hex(parts.end()), digest) << count << " bytes, 7 at a time";
  }
}

}  // namespace
