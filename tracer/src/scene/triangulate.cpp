#include "tracer/triangulate.h"

#include <cmath>

namespace tracer {
namespace {

/// Twice the signed area; positive where a, b, c turn left.
double area(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Projection of the polygon along the dominant axis of its Newell normal, oriented counter-clockwise.
/// (Sutherland, Sproull, Schumacker 1974, "A characterization of ten hidden-surface algorithms", appendix.)
std::vector<Vec2> flatten(std::span<const Vec3> corners) {
  Vec3 normal;
  const Vec3& origin = corners[0];  // close to the polygon: avoids cancellation far from 0
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3& a = corners[i];
    const Vec3& b = corners[(i + 1) % corners.size()];
    normal.x += (a.y - b.y) * ((a.z - origin.z) + (b.z - origin.z));
    normal.y += (a.z - b.z) * ((a.x - origin.x) + (b.x - origin.x));
    normal.z += (a.x - b.x) * ((a.y - origin.y) + (b.y - origin.y));
  }
  const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  const bool along_x = x > y && x > z, along_y = !along_x && y > z;
  const bool mirrored = (along_x ? normal.x : along_y ? normal.y : normal.z) < 0;
  std::vector<Vec2> flat;
  flat.reserve(corners.size());
  for (const Vec3& corner : corners) {
    const Vec2 p = along_x ? Vec2{corner.y, corner.z} : along_y ? Vec2{corner.z, corner.x} : Vec2{corner.x, corner.y};
    flat.push_back(mirrored ? Vec2{p.y, p.x} : p);
  }
  return flat;
}

bool is_fan(const std::vector<Vec2>& polygon) {
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    if (area(polygon[0], polygon[i], polygon[i + 1]) < 0) return false;
  }
  return true;
}

/// Remaining polygon during ear clipping: a ring of corners with a flag for ears.
class Ring {
 public:
  explicit Ring(std::vector<Vec2> polygon) : points_(std::move(polygon)), size_(points_.size()) {
    for (std::size_t i = 0; i < size_; ++i) corner_points_.push_back({(i + size_ - 1) % size_, (i + 1) % size_, false});
    for (std::size_t i = 0; i < size_; ++i) corner_points_[i].ear = is_ear(i);
  }

  /// Removes an ear and returns its triangle; any corner if there is no ear (a self-intersecting polygon).
  std::array<std::uint32_t, 3> cut() {
    std::size_t corner = somewhere_;
    for (std::size_t step = 0; step < size_ && !corner_points_[corner].ear; ++step)
      corner = corner_points_[corner].next;
    const auto [before, after, ear] = corner_points_[corner];
    corner_points_[before].next = after;
    corner_points_[after].before = before;
    --size_;
    somewhere_ = after;
    corner_points_[before].ear = is_ear(before);
    corner_points_[after].ear = is_ear(after);
    return {static_cast<std::uint32_t>(before), static_cast<std::uint32_t>(corner), static_cast<std::uint32_t>(after)};
  }

 private:
  struct Corner {
    std::size_t before, next;
    bool ear;
  };

  [[nodiscard]] bool is_ear(std::size_t corner) const {
    const std::size_t before = corner_points_[corner].before, after = corner_points_[corner].next;
    const Vec2 &a = points_[before], &b = points_[corner], &c = points_[after];
    if (area(a, b, c) < 0) return false;
    for (std::size_t other = corner_points_[after].next; other != before; other = corner_points_[other].next) {
      const Vec2& p = points_[other];
      const bool inside = area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0;
      if (inside && p != a && p != b && p != c) return false;
    }
    return true;
  }

  std::vector<Vec2> points_;
  std::vector<Corner> corner_points_;
  std::size_t size_;
  std::size_t somewhere_ = 0;
};

}  // namespace

bool triangulate(std::span<const Vec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (corners.size() < 3) return false;
  if (corners.size() == 3) {
    triangles.push_back({0, 1, 2});
    return true;
  }
  std::vector<Vec2> flat = flatten(corners);
  if (is_fan(flat)) {
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i) triangles.push_back({0, i, i + 1});
    return true;
  }
  if (corners.size() > ear_clipping_corners_max) return false;
  Ring ring(std::move(flat));
  for (std::size_t left = corners.size(); left > 2; --left) triangles.push_back(ring.cut());
  return true;
}

bool add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, Mesh& mesh) {
  const std::size_t first = mesh.triangles.size();
  if (!triangulate(corners, mesh.triangles)) return false;
  for (std::size_t t = first; t < mesh.triangles.size(); ++t)
    for (std::uint32_t& corner : mesh.triangles[t]) corner = indices[corner];
  if (corners.size() == 3) return true;
  mesh.continues_polygon.resize(first + 1);
  mesh.continues_polygon.resize(mesh.triangles.size(), 1);
  return true;
}

}  // namespace tracer
