// The reference tracer's geometry: what a ray meets, and what the surface is there.
#include <algorithm>
#include <numbers>
#include <variant>

#include "tests/support/reference_tracer.h"

namespace oracle {
namespace {

constexpr Real pi = std::numbers::pi_v<Real>;

/// The two axes across `n`: e0 is `first` without its part along n, or z where that is nothing.
std::pair<Vec, Vec> axes(const Vec& n, const Vec& first) {
  Vec e0 = first - dot(first, n) * n;
  if (length(e0) < 1e-13L * length(first)) e0 = Vec(0, 0, 1) - n.z * n;
  e0 = unit(e0);
  return {e0, cross(n, e0)};
}

}  // namespace

ReferenceTracer::ReferenceTracer(const tracer::Scene& scene) : scene_(scene) {
  for (const tracer::Object& object : scene.objects) {
    Body body{&object.shape, &scene.materials[object.material.index], {}};
    if (const auto* triangle = std::get_if<tracer::Triangle>(&object.shape)) {
      const auto& p = triangle->vertices;
      Face face{p[0], p[1], p[2], {}, {}, {}, {0, 0}, {1, 0}, {0, 1}};
      if (const auto& n = triangle->normals) face.na = unit((*n)[0]), face.nb = unit((*n)[1]), face.nc = unit((*n)[2]);
      if (const auto& uv = triangle->uvs) face.ta = (*uv)[0], face.tb = (*uv)[1], face.tc = (*uv)[2];
      body.faces.push_back(face);
    }
    if (const auto* mesh = std::get_if<tracer::Mesh>(&object.shape)) {
      std::vector<Vec> normals(mesh->positions.size());
      for (std::size_t i = 0; i < mesh->normals.size(); ++i) normals[i] = unit(mesh->normals[i]);
      if (mesh->normals.empty() && mesh->smooth) {
        for (const auto& [a, b, c] : mesh->triangles) {
          const Vec pa = mesh->positions[a];
          const Vec area = cross(Vec(mesh->positions[b]) - pa, Vec(mesh->positions[c]) - pa);
          for (const std::uint32_t corner : {a, b, c}) normals[corner] = normals[corner] + area;
        }
        for (Vec& n : normals)
          if (length(n) > 0) n = unit(n);
      }
      for (const auto& [a, b, c] : mesh->triangles) {
        Face face{mesh->positions[a],
                  mesh->positions[b],
                  mesh->positions[c],
                  normals[a],
                  normals[b],
                  normals[c],
                  {0, 0},
                  {1, 0},
                  {0, 1}};
        if (!mesh->uvs.empty()) face.ta = mesh->uvs[a], face.tb = mesh->uvs[b], face.tc = mesh->uvs[c];
        body.faces.push_back(face);
      }
    }
    bodies_.push_back(std::move(body));
  }
  const Real half_height = std::tan(scene.camera.fov_deg * pi / 360);
  forward_ = unit(Vec(scene.camera.look_at) - Vec(scene.camera.position));
  right_ = unit(cross(forward_, scene.camera.up));
  up_ = half_height * cross(right_, forward_);
  right_ = half_height * right_;
}

ReferenceTracer::Hit ReferenceTracer::nearest(const Ray& ray, Path& path) const {
  Hit best;
  best.t = ray.end;
  const auto offer = [&](const Hit& hit) {
    if (!(hit.t > 0)) return;
    path.near_miss(hit.t / best.t - 1);  // NaN where both are infinite: fmin passes it over
    if (hit.t < best.t) best = hit;
  };
  for (const Body& body : bodies_) {
    if (const auto* sphere = std::get_if<tracer::Sphere>(body.shape)) {
      const Vec f = ray.origin - Vec(sphere->center);
      const Real r = sphere->radius, b = -dot(f, ray.direction);
      if (ray.from == &body) {
        if (b > 0) offer({2 * b, &body});  // from the surface through the inside; outwards it never comes back
        continue;
      }
      const Vec miss = f + b * ray.direction;
      const Real discriminant = (r - length(miss)) * (r + length(miss));
      if (b > 0) path.near_miss(discriminant / (r * r));
      if (discriminant < 0) continue;
      const Real root = std::sqrt(discriminant);
      path.near_miss((b - root) / r);  // starts beside it
      offer({b - root > 0 ? b - root : b + root, &body});
    } else if (const auto* plane = std::get_if<tracer::Plane>(body.shape)) {
      if (ray.from == &body) continue;
      const Vec n = unit(plane->normal);
      path.near_miss(dot(n, ray.direction));
      offer({dot(n, Vec(plane->point) - ray.origin) / dot(n, ray.direction), &body});
    }
    for (const Face& face : body.faces) {
      if (ray.from_face == &face) continue;
      // Volumes spanned by the ray and the edges (Cramer's rule).
      const Vec e1 = face.b - face.a, e2 = face.c - face.a, s = ray.origin - face.a;
      const Real volume = dot(cross(ray.direction, e2), e1);
      const Real u = dot(cross(ray.direction, e2), s) / volume, v = dot(cross(s, e1), ray.direction) / volume;
      const Real t = dot(cross(s, e1), e2) / volume;
      const Real inside = std::fmin(u, std::fmin(v, 1 - u - v));
      if (t > 0) path.near_miss(inside);
      if (inside >= 0) offer({t, &body, &face, u, v});
    }
  }
  return best;
}

ReferenceTracer::Point ReferenceTracer::point_at(const Ray& ray, const Hit& hit) const {
  Point point;
  point.hit = hit;
  point.position = ray.origin + hit.t * ray.direction;
  if (const auto* sphere = std::get_if<tracer::Sphere>(hit.body->shape)) {
    point.face_normal = point.normal = unit(point.position - Vec(sphere->center));
  } else if (const auto* plane = std::get_if<tracer::Plane>(hit.body->shape)) {
    point.face_normal = point.normal = unit(plane->normal);
  } else {
    const Face& f = *hit.face;
    point.face_normal = point.normal = unit(cross(f.b - f.a, f.c - f.a));
    const Vec bent = (1 - hit.u - hit.v) * f.na + hit.u * f.nb + hit.v * f.nc;
    if (length(bent) > 1e-6L) point.normal = unit(bent);
    if (dot(point.normal, point.face_normal) < 0) point.normal = -point.normal;
  }
  point.back = dot(ray.direction, point.face_normal) > 0;
  if (point.back) point.normal = -point.normal, point.face_normal = -point.face_normal;
  return point;
}

Light3 ReferenceTracer::surface_color(const Point& point, Path& path) const {
  const tracer::Material& material = *point.hit.body->material;
  if (const auto* color = std::get_if<tracer::Color>(&material.color)) return *color;
  const tracer::Texture& texture = scene_.textures[std::get<tracer::TextureId>(material.color).index];
  Real u = 0, v = 0;
  if (const auto* sphere = std::get_if<tracer::Sphere>(point.hit.body->shape)) {
    const Vec pole = unit(sphere->axis), n = unit(point.position - Vec(sphere->center));
    const auto [e0, e1] = axes(pole, sphere->meridian);
    const Real turns = std::atan2(dot(n, e1), dot(n, e0)) / (2 * pi);
    u = turns < 0 ? turns + 1 : turns;
    v = 1 - std::acos(std::clamp(dot(n, pole), -1.0L, 1.0L)) / pi;
  } else if (const auto* plane = std::get_if<tracer::Plane>(point.hit.body->shape)) {
    const auto [e0, e1] = axes(unit(plane->normal), plane->u_axis.value_or(tracer::Vec3{1, 0, 0}));
    u = dot(point.position - Vec(plane->point), e0);
    v = dot(point.position - Vec(plane->point), e1);
  } else {
    const Face& f = *point.hit.face;
    const Real weight = 1 - point.hit.u - point.hit.v;
    u = weight * f.ta.x + point.hit.u * f.tb.x + point.hit.v * f.tc.x;
    v = weight * f.ta.y + point.hit.u * f.tb.y + point.hit.v * f.tc.y;
  }
  u = u * texture.scale.x + texture.offset.x;
  v = v * texture.scale.y + texture.offset.y;
  for (const Real c : {u, v}) path.near_miss((c - std::round(c)) / std::fmax(1.0L, std::fabs(c)));
  const auto& checker = std::get<tracer::CheckerTexture>(texture.pattern);
  return checker.colors[std::fmod(std::floor(u) + std::floor(v), 2.0L) == 0 ? 0 : 1];
}

}  // namespace oracle
