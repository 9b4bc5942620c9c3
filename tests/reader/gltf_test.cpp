/// glTF and GLB files: the transformed triangles of a scene, or the place of the error.

#include "api/src/gltf/gltf.h"

#include <gtest/gtest.h>

#include "api/src/gltf/file.h"
#include "tests/reader/gltf_files.h"
#include "tests/support/random.h"

namespace {

using namespace mesh_files;
using tracer::Vec3;

tracer::Mesh read(const Bytes& bytes) {
  EXPECT_TRUE(api::gltf::is_gltf(bytes));
  auto mesh = api::gltf::read_gltf({bytes}, {});
  EXPECT_TRUE(mesh) << mesh.error();
  if (!mesh) return {};
  EXPECT_EQ(broken_promise(*mesh, {}), "");
  return *std::move(mesh);
}

tracer::Mesh read(const std::string& text) { return read(bytes_of(text)); }

std::string refusal(const Bytes& bytes, const tracer::Limits& limits = {}) {
  const auto mesh = api::gltf::read_gltf({bytes}, limits);
  return mesh ? "accepted" : mesh.error();
}

std::string refusal(const std::string& text, const tracer::Limits& limits = {}) {
  return refusal(bytes_of(text), limits);
}

/// The pyramid's file with one piece of its text changed.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = gltf_files::pyramid_gltf();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// A file of one primitive: `positions` as floats, and `indices`, if any, as uint8.
std::string soup(const std::vector<Vec3>& positions, const std::vector<std::uint8_t>& indices, int mode) {
  Bytes bytes;
  for (const Vec3& p : positions)
    for (const double value : {p.x, p.y, p.z}) append(bytes, static_cast<float>(value));
  const std::string size = std::to_string(bytes.size());
  bytes.insert(bytes.end(), indices.begin(), indices.end());
  std::string accessors = R"({"bufferView": 0, "componentType": 5126, "count": )" + std::to_string(positions.size()) +
                          R"(, "type": "VEC3"})";
  if (!indices.empty()) {
    accessors += R"(, {"bufferView": 0, "byteOffset": )" + size + R"(, "componentType": 5121, "count": )" +
                 std::to_string(indices.size()) + R"(, "type": "SCALAR"})";
  }
  return gltf_files::gltf(R"("buffers": [{"byteLength": )" + std::to_string(bytes.size()) +
                          R"(, "uri": "data:;base64,)" + gltf_files::base64(bytes) +
                          R"("}], "bufferViews": [{"buffer": 0, "byteLength": )" + std::to_string(bytes.size()) +
                          R"(}], "accessors": [)" + accessors + R"(], "meshes": [{"primitives": [{"mode": )" +
                          std::to_string(mode) + R"(, "attributes": {"POSITION": 0})" +
                          (indices.empty() ? "" : R"(, "indices": 1)") + "}]}]");
}

std::vector<Vec3> positions_of(const tracer::Mesh& mesh) {
  std::vector<Vec3> positions;
  for (const Corner& corner : corners(mesh)) positions.push_back(corner.position);
  return positions;
}

TEST(GltfReader, ReadsPositionsNormalsAndFlippedUvs) {
  const auto expected = corners(pyramid());
  EXPECT_EQ(corners(read(gltf_files::pyramid_gltf())), expected);
  EXPECT_EQ(corners(read(gltf_files::pyramid_glb())), expected);
  EXPECT_EQ(corners(read("\xEF\xBB\xBF \n" + gltf_files::pyramid_gltf())), expected);
}

TEST(GltfReader, ReadsStripsAndFansWithAndWithoutIndices) {
  const std::vector<Vec3> p{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}};
  EXPECT_EQ(positions_of(read(soup(p, {}, 4))), (std::vector{p[0], p[1], p[2]}));
  EXPECT_EQ(positions_of(read(soup(p, {}, 5))), (std::vector{p[0], p[1], p[2], p[1], p[3], p[2], p[2], p[3], p[4]}));
  EXPECT_EQ(positions_of(read(soup(p, {4, 3, 2, 0}, 6))), (std::vector{p[3], p[2], p[4], p[2], p[0], p[4]}));
  EXPECT_EQ(positions_of(read(soup(p, {2, 0, 1}, 4))), (std::vector{p[2], p[0], p[1]}));
  EXPECT_TRUE(read(soup(p, {}, 4)).normals.empty());
  EXPECT_EQ(read(soup(p, {2, 0, 1}, 4)).positions.size(), 3u) << "unused vertices are omitted";
}

TEST(GltfReader, AppliesTransformsOfTheScenesNodes) {
  // The child is scaled, then turned about z from x to y, then moved; the root doubles all of it. Node 2 is in no
  // scene.
  const std::string nodes = R"(, "scene": 1, "scenes": [{"nodes": [2]}, {"nodes": [0]}], "nodes": [
    {"children": [1], "matrix": [2,0,0,0, 0,2,0,0, 0,0,2,0, 10,20,30,1]},
    {"mesh": 0, "translation": [1,2,3], "rotation": [0,0,0.7071067811865476,0.7071067811865476], "scale": [4,1,1]},
    {"mesh": 0}])";
  const auto before = corners(pyramid()), after = corners(read(gltf_files::pyramid_gltf(nodes)));
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3 &p = before[i].position, &n = before[i].normal, &m = after[i].normal;
    EXPECT_NEAR(after[i].position.x, 10 + 2 * (1 - p.y), 1e-14);
    EXPECT_NEAR(after[i].position.y, 20 + 2 * (2 + 4 * p.x), 1e-14);
    EXPECT_NEAR(after[i].position.z, 30 + 2 * (3 + p.z), 1e-14);
    // By the inverse transpose: n.x shrinks where positions grow; only the direction counts.
    const Vec3 expected{-n.y, n.x / 4, n.z};
    EXPECT_NEAR(m.x * expected.y, m.y * expected.x, 1e-15);
    EXPECT_NEAR(m.y * expected.z, m.z * expected.y, 1e-15);
    EXPECT_GT(m.x * expected.x + m.y * expected.y + m.z * expected.z, 0);
  }
  const std::string without_scenes = nodes.substr(nodes.find(", \"nodes\": ["));
  EXPECT_EQ(corners(read(gltf_files::pyramid_gltf(without_scenes))).size(), 2 * before.size()) << "all roots";
}

TEST(GltfReader, ReversesWindingUnderMirroringNodes) {
  const auto plain = corners(pyramid());
  const auto mirrored = corners(read(gltf_files::pyramid_gltf(R"(, "nodes": [{"mesh": 0, "scale": [-1, 1, 1]}])")));
  for (std::size_t i = 0; i < plain.size(); i += 3) {
    for (const auto& [to, from] : {std::pair{0, 0}, {1, 2}, {2, 1}}) {
      const Corner &m = mirrored[i + to], &p = plain[i + from];
      EXPECT_EQ(m.position, (Vec3{-p.position.x, p.position.y, p.position.z}));
      EXPECT_GT(-m.normal.x * p.normal.x + m.normal.y * p.normal.y + m.normal.z * p.normal.z, 0);
    }
  }
}

TEST(GltfReader, AddsFaceNormalsIfOnlySomePartsHaveNormals) {
  const std::string mesh =
      R"({"primitives": [{"attributes": {"POSITION": 0}, "indices": 3},
                         {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 3}, {"mode": 1, "attributes": {}}]}])";
  std::string text = gltf_files::pyramid_gltf();
  text = text.substr(0, text.find("\"meshes\": [") + 11) + mesh + "}";
  const auto both = corners(read(text)), pyramid = corners(mesh_files::pyramid());
  ASSERT_EQ(both.size(), 2 * pyramid.size());
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(both[i].normal, (Vec3{0, -1, 0})) << "the square at the bottom";
  for (std::size_t i = 0; i < pyramid.size(); ++i) {
    EXPECT_EQ(both[i].position, pyramid[i].position);
    const Vec3 &got = both[pyramid.size() + i].normal, &n = pyramid[i].normal;
    EXPECT_NEAR(got.x * n.z, got.z * n.x, 1e-15);
  }
}

TEST(GltfReader, ReadsQuantizedAttributes) {
  Bytes bytes{0, 0, 0, 127, 0, 129, 0, 64, 0};  // int8: 0 0 0, 127 0 -127, 0 64 0
  const std::string text = gltf_files::gltf(
      R"("extensionsRequired": ["KHR_mesh_quantization"], "buffers": [{"byteLength": 9, "uri": "data:;base64,)" +
      gltf_files::base64(bytes) +
      R"("}], "bufferViews": [{"buffer": 0, "byteLength": 9}], "accessors": [{"bufferView": 0, "componentType": 5120,
      "normalized": true, "count": 3, "type": "VEC3"}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}])");
  EXPECT_EQ(positions_of(read(text)), (std::vector<Vec3>{{0, 0, 0}, {1, 0, -1}, {0, 64.0 / 127, 0}}));
}

/// Rows of floats: their type and values.
struct Rows {
  std::string type;
  std::vector<float> values;
};

/// A file with an accessor for each of them, and further members.
std::string floats(const std::vector<Rows>& all, const std::string& members) {
  Bytes bytes;
  std::string accessors;
  for (const auto& [type, values] : all) {
    const std::size_t components = type == "SCALAR" ? 1
                                   : type == "MAT4" ? 16
                                                    : static_cast<std::size_t>(type.back() - '0');
    accessors += (accessors.empty() ? "" : ", ") +
                 (R"({"bufferView": 0, "byteOffset": )" + std::to_string(bytes.size())) +
                 R"(, "componentType": 5126, "count": )" + std::to_string(values.size() / components) +
                 R"(, "type": ")" + type + "\"}";
    for (const float value : values) append(bytes, value);
  }
  const std::string size = std::to_string(bytes.size());
  return gltf_files::gltf(R"("buffers": [{"byteLength": )" + size + R"(, "uri": "data:;base64,)" +
                          gltf_files::base64(bytes) + R"("}], "bufferViews": [{"buffer": 0, "byteLength": )" + size +
                          R"(}], "accessors": [)" + accessors + "], " + members);
}

const std::vector<float> triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

/// The first corner of the triangle, at a time.
Vec3 first_corner(const std::string& text, std::optional<double> time) {
  const Bytes bytes = bytes_of(text);
  const auto mesh = api::gltf::read_gltf({.bytes = bytes, .time = time}, {});
  EXPECT_TRUE(mesh) << mesh.error();
  return mesh ? mesh->positions[mesh->triangles[0][0]] : Vec3{-99, 0, 0};
}

TEST(GltfReader, MovesNodesByTheFirstAnimation) {
  const auto moved = [](const std::string& interpolation, const std::string& path, const std::string& type,
                        const std::vector<float>& values) {
    return floats({{"VEC3", {1, 0, 0, 2, 0, 0, 1, 1, 0}}, {"SCALAR", {0, 1, 3}}, {type, values}},
                  R"("meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}],
                  "animations": [{"samplers": [{"input": 1, "output": 2, "interpolation": ")" +
                      interpolation + R"("}], "channels": [{"sampler": 0, "target": {"node": 0, "path": ")" + path +
                      R"("}}]}])");
  };
  const std::vector<float> steps{0, 0, 0, 2, 0, 0, 6, 4, 0}, turns{0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1};
  // In-tangent, value and out-tangent; half a second after the first key the out-tangent counts an eighth.
  const std::vector<float> cubic{0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 6, 4, 0, 0, 0, 0};
  const std::string linear = moved("LINEAR", "translation", "VEC3", steps),
                    rotation = moved("LINEAR", "rotation", "VEC4", turns);
  EXPECT_EQ(first_corner(linear, std::nullopt), (Vec3{1, 0, 0}));
  EXPECT_EQ(first_corner(linear, 2), (Vec3{5, 2, 0}));
  EXPECT_EQ(first_corner(linear, -1), (Vec3{1, 0, 0}));
  EXPECT_EQ(first_corner(linear, 99), (Vec3{7, 4, 0}));
  EXPECT_EQ(first_corner(moved("STEP", "translation", "VEC3", steps), 2.9), (Vec3{3, 0, 0}));
  EXPECT_EQ(first_corner(moved("CUBICSPLINE", "translation", "VEC3", cubic), 0.5), (Vec3{2.5, 0, 0}));
  const Vec3 turned = first_corner(rotation, 0.5);
  EXPECT_NEAR(turned.x, 0, 1e-7);
  EXPECT_NEAR(std::abs(turned.y), 1, 1e-7) << "half of half a turn";
}

/// Joint 1 has moved by 8 along y since it was bound at x = 1, and moves back in a second; the node of the mesh counts
/// for nothing.
std::string moving_skin() {
  return floats(
      {{"VEC3", triangle},
       {"VEC4", {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}},
       {"VEC4", {.25, .75, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}},
       {"MAT4", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}},
       {"SCALAR", {0, 1}},
       {"VEC3", {1, 8, 0, 1, 0, 0}}},
      R"("meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1,
      "WEIGHTS_0": 2}}]}], "skins": [{"joints": [1, 2], "inverseBindMatrices": 3}], "nodes": [
      {"mesh": 0, "skin": 0, "translation": [99, 0, 0]}, {}, {"translation": [1, 8, 0]}], "animations": [{"samplers":
      [{"input": 4, "output": 5}], "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}]}])");
}

TEST(GltfReader, DeformsBySkinsMorphTargetsAndSparseRows) {
  const std::string morph = floats({{"VEC3", triangle}, {"VEC3", {0, 0, 2, 0, 0, 2, 0, 0, 2}}},
                                   R"("meshes": [{"weights": [0.5], "primitives": [{"attributes": {"POSITION": 0},
      "targets": [{"POSITION": 1}]}]}], "nodes": [{"mesh": 0}])");
  EXPECT_EQ(first_corner(morph, {}), (Vec3{0, 0, 1}));
  EXPECT_EQ(first_corner(moving_skin(), {}), (Vec3{0, 6, 0}));
  EXPECT_EQ(first_corner(moving_skin(), 0.5), (Vec3{0, 3, 0}));
  std::string sparse = floats({{"VEC3", triangle}, {"VEC3", {7, 8, 9}}, {"SCALAR", {0}}},
                              R"("meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}])");
  const std::string type = R"("count": 3, "type": "VEC3")";
  sparse.insert(sparse.find(type),
                R"("sparse": {"count": 1, "indices": {"bufferView": 0, "byteOffset": 48, "componentType": 5121},
      "values": {"bufferView": 0, "byteOffset": 36}}, )");
  EXPECT_EQ(first_corner(sparse, {}), (Vec3{7, 8, 9}));
}

TEST(GltfReader, ReportsPlaceAndReason) {
  const std::pair<std::string, std::string> cases[] = {
      {"{", "byte 1: "},
      {"{}", "its JSON: must be a glTF file"},
      {R"({"asset": {"version": "1.0"}})", "/asset/version: must be 2.x, got the string \"1.0\""},
      {gltf_files::gltf(R"("meshes": [])"), "its JSON: has no triangles"},
      {gltf_files::gltf(R"("extensionsRequired": ["KHR_draco_mesh_compression"])"),
       "/extensionsRequired/0: the file needs the extension \"KHR_draco_mesh_compression\""},
      {gltf_files::gltf(R"("buffers": [{"byteLength": 4, "uri": "../secret.bin"}])"),
       "/buffers/0/uri: names another file"},
      {gltf_files::gltf(R"("buffers": [{"byteLength": 4, "uri": "data:;base64,A"}])"), "/buffers/0/uri: is no base64"},
      {gltf_files::gltf(R"("buffers": [{"byteLength": 4}])"), "/buffers/0: has neither a uri"},
      {changed("196", "197"), "/buffers/0: declares 197 bytes, there are 196"},
      {changed("\"byteLength\": 36", "\"byteLength\": 37"), "/bufferViews/1: ends at byte 197, its buffer has 196"},
      {changed("\"buffer\": 0", "\"buffer\": 1"), "/bufferViews/0/buffer: must be an integer from 0 to 0"},
      {changed("\"byteStride\": 32", "\"byteStride\": 8"), "/accessors/0: rows have 12 bytes"},
      {changed("\"byteOffset\": 24", "\"byteOffset\": 28"), "/accessors/2: its 5 rows end at byte 164"},
      {changed("\"count\": 5", "\"count\": 4294967294"), "/accessors/0: its 4294967294 rows end"},
      {changed("\"count\": 5", "\"count\": -1"), "/accessors/0/count: must be an integer from 0"},
      {changed("\"count\": 5", "\"count\": 4"), "/attributes/NORMAL: has 5 rows, but there are 4 positions"},
      {changed("\"bufferView\": 1,", "\"sparse\": {}, \"bufferView\": 1,"),
       "/accessors/3/sparse: must have \"indices\""},
      {floats({{"VEC3", triangle}}, R"("meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
               "nodes": [{"mesh": 0, "skin": 0}])"),
       "/nodes/0/skin: there are no skins"},
      {changed("\"componentType\": 5123", "\"componentType\": 5122"), "/indices: must be an accessor of SCALAR"},
      {changed("\"componentType\": 5123", "\"componentType\": 5124"), "the componentType must be"},
      {changed("\"VEC2\"", "\"VEC5\""), "/accessors/2/type: must be SCALAR"},
      {changed("\"POSITION\": 0", "\"POSITION\": 2"), "/POSITION: must be an accessor of VEC3"},
      {changed("\"POSITION\": 0", "\"POSITION\": 9"), "/POSITION: must be an integer from 0 to 3"},
      {changed("\"POSITION\"", "\"position\""), "/attributes: must have \"POSITION\""},
      {changed("\"indices\": 3", "\"indices\": 3, \"mode\": 7"), "/mode: must be an integer from 0 to 6"},
      {soup({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 3}, 4),
       "/meshes/0/primitives/0: its index 2 must be one of the 3 positions, got 3"},
      {soup({{0, 0, 0}, {1, std::nan(""), 0}, {0, 1, 0}}, {}, 4), "/meshes/0/primitives/0: the vertex 1 is not finite"},
      {soup({{0, 0, 0}, {1, 0, 0}}, {}, 5), "its JSON: has no triangles"},
      {gltf_files::pyramid_gltf(R"(, "nodes": [{"mesh": 1}])"), "/nodes/0/mesh: must be an integer from 0 to 0"},
      {gltf_files::pyramid_gltf(R"(, "nodes": [{"mesh": 0, "scale": [1e40, 1e40]}])"),
       "/nodes/0/scale: must be 3 finite"},
      {gltf_files::pyramid_gltf(R"(, "nodes": [{"mesh": 0, "scale": [1e61, 1, 1]}])"),
       "beyond the limit coordinate_max"},
      {gltf_files::pyramid_gltf(R"(, "nodes": [{"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]}])"),
       "/nodes/0/matrix: the last row"},
  };
  for (const auto& [text, reason] : cases)
    EXPECT_NE(refusal(text).find(reason), std::string::npos) << reason << "\n" << refusal(text) << "\n" << text;
}

TEST(GltfReader, RejectsNodesThatAreNoTree) {
  for (const char* nodes :
       {R"(, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "children": [0]}])",
        R"(, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "children": [1]}, {"children": [0]}])",
        R"(, "scenes": [{"nodes": [0, 0]}], "nodes": [{"mesh": 0}])",
        R"(, "nodes": [{"children": [2]}, {"children": [2]}, {"mesh": 0}])"})
    EXPECT_NE(refusal(gltf_files::pyramid_gltf(nodes)).find("the node is reached twice"), std::string::npos) << nodes;
  std::string deep = R"(, "nodes": [{"mesh": 0})";
  for (int i = 0; i < 100'000; ++i) deep += R"(,{"children":[)" + std::to_string(i) + "]}";
  EXPECT_EQ(refusal(gltf_files::pyramid_gltf(deep + "]")), "accepted") << "a chain of any length is a tree";
}

TEST(GltfReader, RejectsCountsAboveTheLimits) {
  EXPECT_EQ(refusal(gltf_files::pyramid_gltf(), {.triangles = 6}), "accepted");
  EXPECT_NE(refusal(gltf_files::pyramid_gltf(), {.triangles = 5}).find("the limit triangles is 5"), std::string::npos);
  std::string many = R"(, "nodes": [{"mesh": 0})";
  for (int i = 0; i < 99; ++i) many += R"(,{"mesh": 0})";
  many += "]";
  EXPECT_NE(refusal(gltf_files::pyramid_gltf(many), {.triangles = 599}).find("at least 600"), std::string::npos);
  EXPECT_NE(refusal(gltf_files::pyramid_gltf(many), {.objects = 99}).find("the limit objects is 99"),
            std::string::npos);
}

TEST(GltfReader, RejectsTruncatedFiles) {
  for (const Bytes& whole : {gltf_files::pyramid_glb(), bytes_of(gltf_files::pyramid_gltf())})
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_NE(refusal(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))), "accepted") << size;
}

TEST(GltfReader, ReturnsErrorOrValidMeshForCorruptedFiles) {
  oracle::Random random(12);
  for (const Bytes& whole : {gltf_files::pyramid_glb(R"(, "nodes": [{"children": [1]}, {"mesh": 0}])"),
                             bytes_of(gltf_files::pyramid_gltf()), bytes_of(moving_skin())})
    for (int i = 0; i < 3000; ++i) {
      Bytes bytes = whole;
      for (std::uint32_t n = random.below(4) + 1; n > 0; --n)
        bytes[random.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<std::uint8_t>(random.below(256));
      const auto mesh = api::gltf::read_gltf({.bytes = bytes, .time = 0.5}, {.triangles = 1000});
      EXPECT_EQ(mesh ? broken_promise(*mesh, {}) : "", "");
    }
}

/// The examples of RFC 4648, section 10.
TEST(Base64, DecodesTheExamplesOfTheRfcAndRejectsInvalidText) {
  const std::pair<const char*, const char*> examples[] = {{"", ""},        {"Zg==", "f"},        {"Zm8=", "fo"},
                                                          {"Zm9v", "foo"}, {"Zm9vYg==", "foob"}, {"Zm9vYmE=", "fooba"}};
  for (const auto& [text, bytes] : examples) EXPECT_EQ(api::gltf::decode_base64(text), bytes_of(bytes)) << text;
  EXPECT_EQ(api::gltf::decode_base64("Zm9vYg"), bytes_of("foob")) << "padding may be missing";
  EXPECT_EQ(api::gltf::decode_base64("+/+/"), (Bytes{0xfb, 0xff, 0xbf}));
  for (const char* none : {"Z", "Zm9vY", "Zg=", "Z===", "Zm 9", "Zm9v\n", "Zg==Zg==", "Zm-_"})
    EXPECT_FALSE(api::gltf::decode_base64(none)) << none;
}

}  // namespace
