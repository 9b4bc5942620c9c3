/// Files of meshes: from the document's field to triangles.

#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "api/load_assets.h"
#include "tests/reader/gltf_files.h"
#include "tests/reader/reading.h"
#include "tracer/mesh_file.h"
#include "tracer/requirements.h"
#include "tracer/src/math/vec.h"

namespace {

using namespace mesh_files;

/// A scene of one object for each name, the first two smooth, and a prototype that has the first name too.
tracer::Scene scene_of(const std::vector<std::string>& names) {
  std::string objects;
  for (std::size_t i = 0; i < names.size(); ++i)
    objects += (i == 0 ? "" : ", ") + (R"({"type": "mesh", "material": {}, "file": ")" + names[i]) +
               (i < 2 ? R"(", "smooth": true})" : "\"}");
  const std::string prototype = R"([{"type": "mesh", "material": {}, "file": ")" + names[0] + "\"}]";
  return reader_tests::accepted(
             reader_tests::document_with("\"objects\": [" + objects + R"(], "prototypes": {"it": )" + prototype + "}"))
      .scene;
}

const tracer::Mesh& mesh_of(const tracer::Object& object) { return std::get<tracer::Mesh>(object.shape); }

std::vector<tracer::Vec3> positions_of(const tracer::Mesh& mesh) {
  std::vector<tracer::Vec3> positions;
  for (const Corner& corner : corners(mesh)) positions.push_back(corner.position);
  return positions;
}

std::string lines_of(const std::vector<tracer::Issue>& issues) {
  std::string lines;
  for (const tracer::Issue& issue : issues) lines += issue.pointer + " " + issue.code + " " + issue.detail + "\n";
  return lines;
}

TEST(SceneReader, ReadsMeshFiles) {
  const tracer::Scene scene =
      reader_tests::accepted(reader_tests::file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/every_field_of_files.json"))
          .scene;
  ASSERT_EQ(scene.assets.size(), 6u) << "a file named twice is one asset";
  const tracer::Mesh &smooth = mesh_of(scene.objects.at(0)), &plain = mesh_of(scene.objects.at(1));
  EXPECT_EQ(scene.assets.at(smooth.file.value().index).name, "assets/cup.obj");
  EXPECT_EQ(scene.assets.at(smooth.file.value().index).path, "/objects/0/file");
  EXPECT_EQ(plain.file, smooth.file);
  const tracer::Mesh& moved = mesh_of(scene.objects.at(2));
  EXPECT_EQ(moved.time, 0.5F);
  const auto& buffers = scene.assets.at(moved.file.value().index).buffers;
  ASSERT_EQ(buffers.size(), 1u);
  EXPECT_EQ(scene.assets.at(buffers[0].index).name, "assets/cup.bin");
  EXPECT_TRUE(smooth.smooth);
  EXPECT_FALSE(plain.smooth);
  EXPECT_EQ(scene.objects[0].transform.value().rows[1][1], 2);
  EXPECT_TRUE(smooth.part_materials.empty());
  ASSERT_EQ(plain.part_materials.size(), 2u);
  EXPECT_EQ(scene.materials.at(plain.part_materials.at("handle").index).diffuse, 0.5);
  EXPECT_EQ(scene.materials.at(plain.part_materials.at("a/b").index).diffuse, 0.25);
}

TEST(LoadMeshes, RecognizesFormatsByContent) {
  tracer::Scene scene = scene_of({"a.obj", "b.obj", "c.obj", "d.obj", "e.obj", "a.obj"});
  ASSERT_EQ(scene.assets.size(), 5u);
  const tracer::Assets assets{{bytes_of(obj(pyramid())), binary_stl(pyramid()),
                               ply(pyramid(), PlyEncoding::big_endian, false), gltf_files::pyramid_glb(),
                               bytes_of(gltf_files::pyramid_gltf())}};
  EXPECT_EQ(lines_of(api::load_meshes(scene, assets, {})), "");
  for (std::size_t i = 0; i < 6; ++i) {
    const tracer::Mesh& mesh = mesh_of(scene.objects[i]);
    EXPECT_FALSE(mesh.file);
    EXPECT_EQ(mesh.smooth, i < 2) << i;
    EXPECT_EQ(mesh.normals.empty(), i == 1) << "STL has none";
    EXPECT_EQ(positions_of(mesh), positions_of(pyramid())) << i;
    if (i == 1) continue;
    EXPECT_EQ(corners(mesh), corners(pyramid())) << i;
  }
  EXPECT_EQ(corners(mesh_of(scene.prototypes[0].objects[0])), corners(pyramid()));
  EXPECT_FALSE(mesh_of(scene.prototypes[0].objects[0]).smooth);
}

TEST(LoadMeshes, ReportsEveryBadFileWithItsFirstUseAndThePlaceInIt) {
  tracer::Scene scene = scene_of({"a.obj", "b.stl", "c.gltf", "d.ply"});
  const tracer::Assets assets{
      {bytes_of("v 0 0 0\nv 1 0\n"), binary_stl(pyramid()), bytes_of("{\"asset\": 1}")}};  // no d.ply
  EXPECT_EQ(lines_of(api::load_meshes(scene, assets, {})),
            "/prototypes/it/0/file bad_asset a.obj: line 2: a number is missing\n"
            "/objects/0/file bad_asset a.obj: line 2: a number is missing\n"
            "/objects/2/file bad_asset c.gltf: its JSON: must be a glTF file, whose \"asset\" has a \"version\"\n"
            "/objects/3/file bad_asset d.ply: is empty\n");
}

TEST(LoadMeshes, EnforcesTheLimitsOfTheScene) {
  const tracer::Assets assets{{binary_stl(pyramid())}};
  const std::vector<std::string> thrice{"a", "a", "a"};  // and the prototype, which nothing places
  tracer::Scene fits = scene_of(thrice);
  EXPECT_EQ(lines_of(api::load_meshes(fits, assets, {.triangles = 24})), "");
  tracer::Scene large = scene_of(thrice);
  EXPECT_EQ(lines_of(api::load_meshes(large, assets, {.triangles = 23})),
            "/objects limit_exceeded the limit triangles is 23, the meshes of files have more\n");
  tracer::Scene mixed = scene_of({"a"});
  mixed.objects.push_back({pyramid(), mixed.objects[0].material, {}});
  EXPECT_EQ(lines_of(api::load_meshes(mixed, assets, {.triangles = 12})), "");
  tracer::Scene both = scene_of({"a"});
  for (int i = 0; i < 2; ++i) both.objects.push_back({pyramid(), both.objects[0].material, {}});
  EXPECT_NE(lines_of(api::load_meshes(both, assets, {.triangles = 12})).find("/objects limit_exceeded"),
            std::string::npos);
  tracer::Scene far = scene_of({"a"});
  far.objects[0].transform = tracer::Transform{{{{1e60, 0, 0, 0}, {0, 1e60, 0, 0}, {0, 0, 1e60, 0}}}};
  EXPECT_NE(lines_of(api::load_meshes(far, assets, {})).find("coordinate_max"), std::string::npos);
}

/// Four triangles in a row, of which the materials name the second and the fourth; a smooth mesh and a transform.
constexpr std::string_view strip =
    "v 0 0 0\nv 1 0 0\nv 0 1 1\nv 1 1 0\nv 0 2 0\nv 1 2 2\n"
    "f 1 2 3\nusemtl red  paint # shiny\nf 2 4 3\nusemtl\nf 3 4 5\nusemtl blue\nf 4 6 5\n";

tracer::Scene strip_with(const std::string& materials) {
  return reader_tests::accepted(
             reader_tests::document_with(
                 R"("materials": {"red": {"diffuse": 0.5}, "blue": {"diffuse": 0.25}}, "objects": [{"type": "mesh",
                     "file": "strip.obj", "smooth": true, "scale": 2, "material": {"diffuse": 0.125}, "materials": )" +
                 materials + "}]"))
      .scene;
}

tracer::Scene loaded_strip_with(const std::string& materials) {
  tracer::Scene scene = strip_with(materials);
  EXPECT_EQ(lines_of(api::load_meshes(scene, {{bytes_of(strip)}}, {})), "");
  return scene;
}

TEST(LoadMeshes, GivesThePartsOfAFileTheirMaterials) {
  const tracer::Scene scene = loaded_strip_with(R"({"red paint": "red", "blue": "blue"})");
  const tracer::Scene whole = loaded_strip_with("{}");
  const tracer::Mesh& one = mesh_of(whole.objects.at(0));
  EXPECT_TRUE(one.parts.empty());
  ASSERT_EQ(scene.prototypes.size(), 1u);
  EXPECT_EQ(scene.prototypes[0].path, "/objects/0");
  EXPECT_EQ(std::get<tracer::Instance>(scene.objects.at(0).shape).of.index, 0u);
  EXPECT_TRUE(scene.objects[0].transform);
  const auto& parts = scene.prototypes[0].objects;
  ASSERT_EQ(parts.size(), 3u);
  const std::vector<std::vector<std::size_t>> triangles{{0, 2}, {1}, {3}};
  const double diffuse[] = {0.125, 0.5, 0.25};
  for (std::size_t i = 0; i < 3; ++i) {
    const tracer::Mesh& part = mesh_of(parts[i]);
    EXPECT_EQ(scene.materials.at(parts[i].material.index).diffuse, diffuse[i]);
    EXPECT_EQ(broken_promise(part, {}), "");
    EXPECT_TRUE(part.parts.empty() && part.part_materials.empty() && part.smooth);
    ASSERT_EQ(part.triangles.size(), triangles[i].size());
    for (std::size_t t = 0; t < part.triangles.size(); ++t)
      for (std::size_t corner = 0; corner < 3; ++corner)
        EXPECT_EQ(part.positions[part.triangles[t][corner]], one.positions[one.triangles[triangles[i][t]][corner]]);
  }
}

TEST(LoadMeshes, NamesTheObjectOfTheDocumentInMessagesAboutItsParts) {
  tracer::Scene scene = loaded_strip_with(R"({"red paint": "red", "blue": "blue"})");
  std::vector<tracer::RequirementReason> reasons;
  tracer::requirements(scene, &reasons);
  const auto triangles = std::find_if(reasons.begin(), reasons.end(), [](const tracer::RequirementReason& reason) {
    return reason.needed == &tracer::Requirements::triangles;
  });
  ASSERT_NE(triangles, reasons.end());
  EXPECT_EQ(triangles->pointer, "/objects/0");
  scene.prototypes.at(0).objects.at(1).transform = tracer::Transform{};
  scene.prototypes[0].objects[1].transform->rows[0] = {0, 0, 0, 0};
  EXPECT_EQ(lines_of(tracer::validate(scene, {})),
            "/objects/0/transform degenerate is singular: it flattens space, and there is no way back\n");
}

TEST(LoadMeshes, KeepsSmoothNormalsAcrossTheBordersOfParts) {
  const tracer::Scene scene = loaded_strip_with(R"({"red paint": "red", "blue": "blue"})");
  const tracer::Scene whole = loaded_strip_with("{}");
  const tracer::Mesh& one = mesh_of(whole.objects.at(0));
  const std::vector<tracer::Vec3> expected = tracer::area_weighted_normals(one);
  for (const tracer::Object& object : scene.prototypes.at(0).objects) {
    const tracer::Mesh& part = mesh_of(object);
    ASSERT_EQ(part.normals.size(), part.positions.size());
    for (std::size_t i = 0; i < part.positions.size(); ++i) {
      const auto place = std::find(one.positions.begin(), one.positions.end(), part.positions[i]);
      const tracer::Vec3 sum = expected[static_cast<std::size_t>(place - one.positions.begin())];
      EXPECT_LT(length(part.normals[i] - normalize(sum)), 2e-15);
    }
  }
}

TEST(LoadMeshes, GivesAFileOfOneMaterialThatMaterial) {
  tracer::Scene scene = strip_with(R"({"it": "red"})");
  ASSERT_EQ(lines_of(api::load_meshes(scene, {{bytes_of("usemtl it\n" + obj(pyramid()))}}, {})), "");
  EXPECT_TRUE(scene.prototypes.empty());
  EXPECT_EQ(scene.materials.at(scene.objects.at(0).material.index).diffuse, 0.5);
  EXPECT_EQ(positions_of(mesh_of(scene.objects[0])), positions_of(pyramid()));
}

TEST(LoadMeshes, ReportsMaterialsThatNoPartHas) {
  tracer::Scene scene = strip_with(R"({"red paint": "red", "blu": "blue", "a/b": "blue"})");
  EXPECT_EQ(
      lines_of(api::load_meshes(scene, {{bytes_of(strip)}}, {})),
      "/objects/0/materials/a~1b unknown_reference the file has no part of the material \"a/b\": it names \"blue\", "
      "\"red paint\"\n"
      "/objects/0/materials/blu unknown_reference the file has no part of the material \"blu\": it names \"blue\", "
      "\"red paint\"\n");
  tracer::Scene plain = strip_with(R"({"it": "red"})");
  EXPECT_EQ(lines_of(api::load_meshes(plain, {{binary_stl(pyramid())}}, {})),
            "/objects/0/materials/it unknown_reference the file has no part of the material \"it\": it names none\n");
}

TEST(LoadMeshes, FindsTheNamesOfGltfMaterials) {
  const auto glb = [](const std::string& material) {
    std::string json = gltf_files::pyramid_gltf(R"(, "materials": [{"name": "gold"}, {}])");
    const std::size_t at = json.find("\"attributes\"");
    return bytes_of(json.insert(at, "\"material\": " + material + ", "));
  };
  for (const auto& [name, index] : {std::pair{"gold", "0"}, {"#1", "1"}}) {
    tracer::Scene scene = strip_with(std::string(R"({")") + name + R"(": "blue"})");
    ASSERT_EQ(lines_of(api::load_meshes(scene, {{glb(index)}}, {})), "");
    EXPECT_EQ(scene.materials.at(scene.objects.at(0).material.index).diffuse, 0.25);
  }
  tracer::Scene scene = strip_with("{}");
  const std::string issues = lines_of(api::load_meshes(scene, {{glb("2")}}, {}));
  EXPECT_NE(issues.find("/objects/0/file bad_asset strip.obj: /meshes/0/primitives/0/material"), std::string::npos)
      << issues;
}

TEST(Validate, RejectsMeshFilesWithoutAssetAndTooMany) {
  tracer::Scene scene = scene_of({"a", "b", "c"});
  EXPECT_EQ(lines_of(tracer::validate(scene, {.assets = 3})), "");
  EXPECT_EQ(lines_of(tracer::validate(scene, {.assets = 2})),
            "/objects/2/file limit_exceeded the limit assets is 2, got 3\n");
  scene.assets.resize(2);
  EXPECT_EQ(lines_of(tracer::validate(scene, {})), "/objects/2/file unknown_reference there is no asset 2\n");
}

TEST(LoadAssets, FreesMeshFiles) {
  tracer::Scene scene = scene_of({"a.obj"});
  const auto read = [](const std::string&) -> api::AssetBytes { return bytes_of(obj(pyramid())); };
  const auto assets = api::load_assets(scene, read, {});
  ASSERT_TRUE(assets);
  EXPECT_EQ(assets->bytes, std::vector<std::vector<std::uint8_t>>(1));
  EXPECT_EQ(positions_of(mesh_of(scene.objects[0])), positions_of(pyramid()));
}

TEST(LoadMeshes, KeepsScenesWithoutMeshFilesUnchanged) {
  tracer::Scene scene = reader_tests::accepted(reader_tests::document_with()).scene;
  EXPECT_EQ(lines_of(api::load_meshes(scene, {}, {})), "");
}

}  // namespace
