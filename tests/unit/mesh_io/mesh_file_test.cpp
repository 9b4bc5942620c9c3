// Mesh files of one shape in every format and encoding give the same mesh.
#include "tracer/mesh_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/mesh_files.h"

namespace tracer {
namespace {

using namespace mesh_files;

Mesh read(const Bytes& bytes, bool smooth = false) {
  auto mesh = read_mesh_file(bytes, {}, smooth);
  EXPECT_TRUE(mesh) << mesh.error();
  if (!mesh) return pyramid();
  EXPECT_EQ(broken_promise(*mesh, {}), "");
  return *std::move(mesh);
}

Mesh read(const std::string& text, bool smooth = false) { return read(bytes_of(text), smooth); }

/// Corners of the pyramid; STL has positions only.
std::vector<Corner> expected(bool positions_only = false) {
  std::vector<Corner> all = corners(pyramid());
  if (positions_only)
    for (Corner& corner : all) corner = {corner.position, {}, {}};
  return all;
}

std::string with_line_ends(const std::string& text, const std::string& line_end) {
  std::string changed;
  for (const char c : text) changed += c == '\n' ? line_end : std::string(1, c);
  return changed;
}

/// Two triangles of a square in the plane z = 0, seen from above; `faces` closes the file.
std::string square_obj(const std::string& faces) { return "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + faces; }

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vec3 &a = mesh.positions[i], &b = mesh.positions[j], &c = mesh.positions[k];
    sum += ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
  }
  return sum;
}

TEST(ObjFile, GivesPositionsNormalsAndUvsOfItsCorners) { EXPECT_EQ(corners(read(obj(pyramid()))), expected()); }

TEST(ObjFile, AcceptsEveryLineEnding) {
  for (const char* line_end : {"\r\n", "\r", " \n\n", "\t# a comment\n"})
    EXPECT_EQ(corners(read(with_line_ends(obj(pyramid()), line_end))), expected()) << line_end;
}

TEST(ObjFile, SupportsNegativeIndicesContinuationLinesAndAllNumberFormats) {
  const std::string plain = square_obj("f 1 2 3 4\n");
  const std::vector<Corner> square = corners(read(plain));
  for (const char* same :
       {"f -4 -3 -2 -1\n", "f 1 \\\n 2 3\\\n 4\n", "f 1// 2// 3// 4//\n", "g a b\ns off\nusemtl x\nf 1 2 3 4",
        "mtllib /nowhere/at.all\no name\nl 1 2\np 1\nvp 0 1\nf 1 2 3 4\n"})
    EXPECT_EQ(corners(read(square_obj(same))), square) << same;
  EXPECT_EQ(corners(read("v +0 -0.0 0e5\nv 10e-1 0 0 0.5\nv 1 1.0 .0 1 0 0\nv 0 +1E+0 1e-400\nf 1 2 3 4")), square);
}

TEST(ObjFile, HasOneVertexPerCombinationOfIndices) {
  const Mesh mesh = read(square_obj("vt 0 0\nvt 1\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/2\nf 1/1 3/2 4/2\n"));
  EXPECT_EQ(mesh.positions.size(), 5u) << "position 3 is there twice, with uvs 3 and 2";
  EXPECT_EQ(mesh.uvs[1], (Vec2{1, 0})) << "v is 0 where it is not written";
  EXPECT_TRUE(mesh.normals.empty());
}

TEST(ObjFile, GivesCornersWithoutNormalTheFaceNormalIfOthersHaveOne) {
  // A ridge along y: the faces on both sides have normals of their own, the third face gives its own.
  const Mesh mesh = read(
      "v 0 0 1\nv 0 1 1\nv -1 0 0\nv 1 0 0\nv 0 -1 0\nvn 0 0 3\nvn 0 0 0\n"
      "f 1 2 3\nf 2 1 4\nf 1//1 3//1 5//1\nf 1//2 4//2 2//2");
  const std::vector<Corner> got = corners(mesh);
  for (std::size_t i = 0; i < 3; ++i) {
    const double half = std::sqrt(0.5);
    EXPECT_NEAR(got[i].normal.x, -half, 1e-15);
    EXPECT_NEAR(got[i].normal.z, half, 1e-15);
    EXPECT_NEAR(got[3 + i].normal.x, half, 1e-15);
    EXPECT_EQ(got[6 + i].normal, (Vec3{0, 0, 3}));
    EXPECT_NEAR(got[9 + i].normal.x, half, 1e-15) << "a normal of length zero is none";
  }
}

TEST(ObjFile, IsSmoothAcrossUvSeams) {
  // Two faces of a ridge whose uvs differ on both sides of it.
  const std::string ridge = "v 0 0 1\nv 0 1 1\nv -1 0 0\nv 1 0 0\nvt 0 0\nvt 1 0\nf 1/1 2/1 3/1\nf 2/2 1/2 4/2\n";
  const Mesh smooth = read(ridge, true);
  ASSERT_EQ(smooth.positions.size(), 6u);
  for (const Corner& corner : corners(smooth)) {
    if (corner.position.x != 0) continue;
    EXPECT_EQ(corner.normal, (Vec3{0, 0, 1})) << "the mean of (-1,0,1) and (1,0,1)";
  }
  EXPECT_TRUE(read(ridge).normals.empty());
}

TEST(ObjFile, CutsPolygonsIntoTrianglesThatCoverThem) {
  // An L, entered at its inner corner's neighbour, so that it is no fan.
  const Mesh mesh = read("v 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nv 0 0 0\nv 2 0 0\nf 1 2 3 4 5 6\n");
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_DOUBLE_EQ(area(mesh), 4);
}

TEST(PlyFile, GivesTheSameInEveryEncodingAndType) {
  for (const PlyEncoding encoding : {PlyEncoding::ascii, PlyEncoding::little_endian, PlyEncoding::big_endian})
    for (const bool wide : {false, true})
      EXPECT_EQ(corners(read(ply(pyramid(), encoding, wide))), expected()) << static_cast<int>(encoding) << wide;
}

TEST(PlyFile, ReadsKnownElementsInAnyOrderAndSkipsOthers) {
  const Mesh mesh = read(
      "ply\r\nformat ascii 1.0\r\nobj_info none\r\nelement face 2\r\nproperty uchar red\r\n"
      "property list uchar float texcoord\r\nproperty list int short vertex_index\r\nelement camera 1\r\n"
      "property list uint8 double matrix\r\nproperty int id\r\nelement nothing 0\r\nelement vertex 5\r\n"
      "property list uchar uchar tags\r\nproperty float32 z\r\nproperty uint8 quality\r\nproperty int16 y\r\n"
      "property float64 x\r\nend_header\r\n"
      "255 6 0 0 1 0 1 1 4 0 1 3 4\r\n0 0 3 4 1 0\r\n3 1 2 3 7\r\n"
      "2 9 9 0.5 1 0 0\r\n0 0.5 1 0 1\r\n1 4 8 8 8 8\r\n0 0.5 1 1 1\r\n0 0.5 1 1 0\r\n");
  ASSERT_EQ(mesh.triangles.size(), 3u);
  EXPECT_EQ(mesh.positions.size(), 4u) << "no face has the third";
  const std::vector<Corner> got = corners(mesh);
  EXPECT_EQ(got[0].position, (Vec3{0, 0, 0.5}));
  EXPECT_EQ(got[1].position, (Vec3{1, 0, 0.5}));
  EXPECT_EQ(got[2].position, (Vec3{1, 1, 0.5}));
  EXPECT_EQ(got[6].position, (Vec3{0, 1, 0.5}));
}

TEST(PlyFile, PutsStripsBeforeFacesInFileOrder) {
  const Mesh mesh = read(
      "ply\nformat ascii 1.0\nelement face 4\nproperty list uchar int vertex_indices\n"
      "element tristrips 1\nproperty list int int vertex_indices\n"
      "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "3 0 1 2\n3 2 3 0\n4 0 1 2 3\n3 0 1 4\n"
      "3 1 2 3\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n");
  const std::vector<std::array<std::uint32_t, 3>> expected{{1, 2, 3}, {0, 1, 2}, {2, 3, 0},
                                                           {0, 1, 2}, {0, 2, 3}, {0, 1, 4}};
  EXPECT_EQ(mesh.triangles, expected);
}

TEST(PlyFile, SplitsStripsIntoTrianglesWithConsistentWinding) {
  const Mesh mesh = read(
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty int x\nproperty int y\nproperty int z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 0\n12 0 1 2 3 3 3 -1 2 3 4 5 -1\n");
  EXPECT_EQ(mesh.triangles.size(), 4u) << "what repeats an index is no triangle";
  EXPECT_DOUBLE_EQ(area(mesh), 2) << "and all are wound alike";
}

TEST(StlFile, GivesItsPositionsInBothEncodings) {
  EXPECT_EQ(corners(read(ascii_stl(pyramid()))), expected(true));
  EXPECT_EQ(corners(read(binary_stl(pyramid()))), expected(true));
  std::string shouted = ascii_stl(pyramid());
  std::transform(shouted.begin(), shouted.end(), shouted.begin(), [](char c) { return c >= 'a' ? c - 'a' + 'A' : c; });
  EXPECT_EQ(corners(read(shouted)), expected(true));
}

TEST(StlFile, SharesVerticesOfEqualPositionMinusZeroIncluded) {
  EXPECT_EQ(read(binary_stl(pyramid())).positions.size(), 5u);
  Mesh twice = pyramid();  // the second half has corners of its own, on the other side of zero
  for (const auto& triangle : pyramid().triangles) {
    for (const std::uint32_t corner : triangle) {
      const Vec3 p = pyramid().positions[corner];
      twice.positions.push_back(p.y == 0 ? Vec3{p.x, -0.0, p.z} : p);
    }
    const auto count = static_cast<std::uint32_t>(twice.positions.size());
    twice.triangles.push_back({count - 3, count - 2, count - 1});
  }
  EXPECT_EQ(read(binary_stl(twice)).positions.size(), 5u);
  EXPECT_EQ(read(ascii_stl(twice)).positions.size(), 5u);
}

}  // namespace
}  // namespace tracer
