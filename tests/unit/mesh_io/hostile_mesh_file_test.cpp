// Invalid mesh files: an error with its position, in bounded time and memory, and never an invalid mesh.
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "tests/support/memory_growth.h"
#include "tests/support/mesh_files.h"
#include "tests/support/random.h"
#include "tracer/mesh_file.h"

namespace tracer {
namespace {

using namespace mesh_files;

std::string refusal(const Bytes& bytes, const Limits& limits = {}) {
  const auto mesh = read_mesh_file(bytes, limits, true);
  if (mesh) return "accepted";
  return mesh.error();
}

std::string refusal(const std::string& text, const Limits& limits = {}) { return refusal(bytes_of(text), limits); }

std::string ply_text(const std::string& declarations, const std::string& rows) {
  return "ply\nformat ascii 1.0\n" + declarations + "end_header\n" + rows;
}

const std::string vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
const std::string three = "0 0 0\n1 0 0\n0 1 0\n";

std::vector<Bytes> every_format() {
  return {bytes_of(obj(pyramid())),
          bytes_of(ascii_stl(pyramid())),
          binary_stl(pyramid()),
          ply(pyramid(), PlyEncoding::ascii, true),
          ply(pyramid(), PlyEncoding::little_endian, false),
          ply(pyramid(), PlyEncoding::big_endian, true)};
}

TEST(HostileMeshFile, IsRejectedWithPositionAndReason) {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::pair<std::string, std::string> cases[] = {
      {"", "is empty"},
      {"\x89PNG", "is no OBJ, PLY, STL or glTF file"},
      {"# only a comment", "is no OBJ, PLY, STL or glTF file"},
      {triangle, "has no faces"},
      {triangle + "f 1 2 4", "line 4: must be the index of one of the 3 positions so far, got \"4\""},
      {triangle + "f 1 2 0", "line 4: must be the index of one of the 3 positions so far, got \"0\""},
      {triangle + "f 1 2 -4", "line 4: must be the index of one of the 3 positions so far, got \"-4\""},
      {triangle + "f 1 2 3/1", "line 4: must be the index of one of the 0 texture coordinates so far, got \"1\""},
      {triangle + "f 1 2 3//9", "line 4: must be the index of one of the 0 normals so far, got \"9\""},
      {triangle + "f 1 2 99999999999999999999999", "line 4: must be the index"},
      {triangle + "f 1 2 nan", "line 4: \"nan\" is no index"},
      {triangle + "f 1 2 1.5", "line 4: \"1.5\" is no index"},
      {triangle + "f 1 2 3/1/1/1", "line 4: \"3/1/1/1\" is no corner"},
      {triangle + "f 1 2", "line 4: a face must have at least 3 corners, has 2"},
      {"v 0 0\nf 1 1 1", "line 1: a number is missing"},
      {"v 0 0 x\x1b[2J", "line 1: \"x?[2J\" is no number"},
      {"v 0 0 nan\n", "line 1: must be finite, got nan"},
      {"v 0 0 1e999\n", "line 1: must be finite, got inf"},
      {"v 0 0 2e60\n", "line 1: the limit coordinate_max is 1e+60, got 2e+60"},
      {"vt 2e30\n", "line 1: the limit value_max is 1e+30, got 2e+30"},
      {"ply\n", "the file ends within its header"},
      {"ply\nend_header\n", "line 2: the header has no format"},
      {"ply\nformat utf8 1.0\n", "line 2: the format must be ascii"},
      {ply_text("element vertex -3\n", ""), "line 3: must be the number of the elements \"vertex\", got \"-3\""},
      {ply_text("property float x\n", ""), "line 3: a property must follow its element"},
      {ply_text("element vertex 1\nproperty half x\n", "0"), "line 4: \"half\" is no type"},
      {ply_text("element face 1\nproperty list float int vertex_indices\n", "0"),
       "line 4: the length of a list must be"},
      {ply_text("element vertex 9\nelement vertex 9\n", ""), "line 4: the element \"vertex\" is declared twice"},
      {ply_text("element void 18446744073709551615\n", ""), "the element \"void\" has no properties"},
      {ply_text("element vertex 1\nproperty float x\n", "0"), "the element \"vertex\" must have x, y and z"},
      {ply_text(vertices + "element face 1\nproperty int a\n", three + "0"), "must have one list vertex_indices"},
      {ply_text(vertices, three), "has no faces"},
      {ply_text(vertices + faces, three + "3 0 1 3"), "face 0: must have the index of one of the 3 vertices, got 3"},
      {ply_text(vertices + faces, three + "3 0 1 -1"), "the index of a vertex must be an integer >= 0"},
      {ply_text(vertices + faces, three + "3 0 1 0.5"), "the index of a vertex must be an integer >= 0"},
      {ply_text(vertices + faces, three + "-3 0 1 2"),
       "the length of the list \"vertex_indices\" must be an integer >= 0"},
      {ply_text(vertices + faces, three + "9 0 1 2"), "too short for the list \"vertex_indices\" of 9"},
      {ply_text(vertices + faces, three + "2 0 1"), "face 0: a face must have at least 3 corners, has 2"},
      {ply_text(vertices + faces, "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2"), "line 11: must be finite, got nan"},
      {ply_text(vertices + faces, "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2"), "line 11: \"zero\" is no number"},
      {ply_text("element tristrips 1\nproperty list int int vertex_indices\n" + vertices, "3 0 1 3\n" + three),
       "tristrips: must have the index of one of the 3 vertices, got 3"},
      {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0\n", "line 5: expected a number, found the end"},
      {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 inf", "line 4: must be finite, got inf"},
      {"solid\nfacet normal 0 0 0\nouter ring", "line 3: expected loop, found \"ring\""},
      {"solid\nfacets", "line 2: expected facet, found \"facets\""},
      {"solid\n", "the file ends before \"endsolid\""},
      {"solid x\nendsolid x", "has no facets"},
  };
  for (const auto& [text, reason] : cases)
    EXPECT_NE(refusal(text).find(reason), std::string::npos) << text << "\n" << refusal(text);
}

TEST(HostileMeshFile, WithNonFiniteBinaryNumbersIsRejected) {
  Bytes stl = binary_stl(pyramid());
  for (std::size_t i = 0; i < 4; ++i) stl[84 + 50 + 12 + i] = 0xff;
  EXPECT_EQ(refusal(stl), "byte 146: must be finite, got -nan");
  Mesh bad = pyramid();
  bad.uvs[2].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(ply(bad, PlyEncoding::big_endian, false)).find("must be finite"), std::string::npos);
  bad = pyramid();
  bad.normals[4].y = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusal(ply(bad, PlyEncoding::little_endian, true)).find("must be finite, got inf"), std::string::npos);
}

TEST(HostileMeshFile, WithMoreTrianglesThanTheLimitIsRejected) {
  for (const Bytes& bytes : every_format()) {
    EXPECT_EQ(refusal(bytes, {.triangles = 6}), "accepted");
    EXPECT_NE(refusal(bytes, {.triangles = 5}).find("the limit triangles is 5"), std::string::npos);
  }
  EXPECT_NE(refusal(ply_text("element tristrips 1\nproperty list int int vertex_indices\n" + vertices,
                             "5 0 1 2 0 1\n" + three),
                    {.triangles = 2})
                .find("the limit triangles is 2"),
            std::string::npos);
}

TEST(HostileMeshFile, TruncatedAnywhereGivesAnErrorOrAValidMesh) {
  const std::vector<Bytes> formats = every_format();
  for (std::size_t f = 0; f < formats.size(); ++f)
    for (std::size_t size = 0; size < formats[f].size(); ++size) {
      // Allocated with the exact size, so that sanitizers detect reads beyond its end.
      const Bytes cut(formats[f].begin(), formats[f].begin() + static_cast<std::ptrdiff_t>(size));
      const auto mesh = read_mesh_file(cut, {}, false);
      if (mesh) {
        EXPECT_EQ(broken_promise(*mesh, {}), "") << f << " " << size;
        EXPECT_TRUE(f == 0 || size + 20 > formats[f].size()) << "only OBJ does not say how much there is: " << f;
      }
    }
}

TEST(HostileMeshFile, WithAnyBytesChangedGivesAnErrorOrAValidMesh) {
  oracle::Random random(11);
  for (const Bytes& format : every_format())
    for (int i = 0; i < 3000; ++i) {
      Bytes changed = format;
      for (std::uint32_t n = random.below(4) + 1; n > 0; --n)
        changed[random.below(static_cast<std::uint32_t>(changed.size()))] =
            static_cast<std::uint8_t>(random.below(256));
      const auto mesh = read_mesh_file(changed, {}, random.chance(0.5));
      EXPECT_EQ(mesh ? broken_promise(*mesh, {}) : "", "");
    }
}

TEST(HostileMeshFile, ThatDeclaresBillionsAllocatesNoMemory) {
  const MemoryGrowth growth;
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::array<std::string, 3> elements[] = {{"element vertex ", xyz, "0 0 0\n"},
                                                 {"element face ", "property list uchar int vertex_index\n", "\n"},
                                                 {"element junk ", "property list uchar int a\n", "\n"}};
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    for (const char* count : {"1000000000", "4294967296", "18446744073709551615"})
      for (const auto& [element, properties, data] : elements) {
        const std::string text = std::string("ply\nformat ") + format + " 1.0\n" + element + count + "\n" + properties +
                                 "end_header\n" + data;
        EXPECT_NE(refusal(text).find("too short"), std::string::npos) << text;
      }
  Bytes stl = binary_stl(pyramid());
  for (std::size_t i = 80; i < 84; ++i) stl[i] = 0xff;
  EXPECT_NE(refusal(stl).find("no OBJ, PLY, STL or glTF file"), std::string::npos);
  EXPECT_NE(refusal("v 1 1 1\nf -1" + std::string(1 << 20, ' ') + "-1 -1\n"), "");
#ifndef WHITTLE_SANITIZED
  EXPECT_LT(growth.kibibytes(), 256 * 1024);
#endif
}

}  // namespace
}  // namespace tracer
