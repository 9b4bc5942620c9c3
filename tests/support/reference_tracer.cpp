#include "tests/support/reference_tracer.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <tuple>
#include <variant>

#include "tests/support/reference_optics.h"

namespace oracle {
namespace {

constexpr Real pi = std::numbers::pi_v<Real>;
constexpr Real infinity = std::numeric_limits<Real>::infinity();

}  // namespace

struct ReferenceTracer::Ray {
  Vec origin, direction;
  const Body* from = nullptr;       // the body it starts on
  const Face* from_face = nullptr;  // the triangle it starts on
  Real end = infinity;
  Inside inside{};  // the transmissive bodies around it, in the order they were entered
};

struct ReferenceTracer::Hit {
  Real t = infinity;
  const Body* body = nullptr;
  const Face* face = nullptr;
  Real u = 0, v = 0;  // barycentric, of triangles
};

struct ReferenceTracer::Point {
  Vec position;
  Vec curved;       // on the curved surface of the interpolated normals
  Vec face_normal;  // on the ray's side
  Vec normal;       // interpolated
  bool back = false;
  Hit hit;
};

/// Media of a ray after it passes a surface: entered from the front, left from the back. An object of the same material
/// replaces a body that was never entered.
ReferenceTracer::Inside ReferenceTracer::beyond(Inside inside, const Point& point) {
  const Body* body = point.hit.body;
  if (!body->has_medium) return inside;
  if (!point.back) {
    inside.push_back(body);
    return inside;
  }
  auto last = std::find(inside.rbegin(), inside.rend(), body);
  if (last == inside.rend())
    last = std::find_if(inside.rbegin(), inside.rend(), [&](const Body* b) { return b->material == body->material; });
  if (last != inside.rend()) inside.erase(std::next(last).base());
  return inside;
}

/// Null: the outside.
const ReferenceTracer::Body* ReferenceTracer::current_medium(const Inside& inside) {
  const Body* best = nullptr;
  for (const Body* body : inside) {
    const auto rank = [](const Body* of) {
      return std::tuple(of->material->priority, of->closed, -of->size, of->material, of);
    };
    if (best == nullptr || rank(body) > rank(best)) best = body;  // elements of vectors
  }
  return best;
}

/// True if the surface of `body` between these media has no effect.
bool ReferenceTracer::hides(const Inside& before, const Inside& after, const Body* body) {
  const Body* medium = current_medium(before);
  return before != after && medium == current_medium(after) && medium->closed &&
         (body->closed || body->material->priority < medium->material->priority);
}

ReferenceTracer::Interface ReferenceTracer::interface_at(const Ray& ray, const Point& point) {
  const auto index = [](const Body* body) -> Real { return body != nullptr ? body->material->ior : 1; };
  const tracer::Material& material = *point.hit.body->material;
  Interface found{beyond(ray.inside, point), index(current_medium(ray.inside)), material.ior};
  if (material.transmission == 0) return found;
  found.n_to = index(current_medium(found.after));
  // The back of a body that was never entered is in its medium.
  if (point.hit.body->has_medium && point.back && found.after == ray.inside) found.n_from = material.ior;
  return found;
}

struct ReferenceTracer::Path {
  tracer::RenderStatistics& counted;
  Real margin = 1;
  void near_miss(Real relative_distance) { margin = std::fmin(margin, std::fabs(relative_distance)); }
};

ReferenceTracer::ReferenceTracer(const tracer::Scene& scene) : scene_(scene) {
  for (const tracer::Object& object : scene.objects) {
    Body body{&object.shape, &scene.materials[object.material.index], {}};
    if (const auto* triangle = std::get_if<tracer::Triangle>(&object.shape)) {
      const auto& p = triangle->vertices;
      Face face{p[0], p[1], p[2]};
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
        Face face{mesh->positions[a], mesh->positions[b], mesh->positions[c], normals[a], normals[b], normals[c]};
        if (!mesh->uvs.empty()) face.ta = mesh->uvs[a], face.tb = mesh->uvs[b], face.tc = mesh->uvs[c];
        body.faces.push_back(face);
      }
    }
    body.size = std::numeric_limits<float>::infinity();
    if (const auto* sphere = std::get_if<tracer::Sphere>(&object.shape))
      body.size = static_cast<float>(sphere->radius * std::sqrt(12.0L));
    if (!body.faces.empty()) {
      Vec low{infinity, infinity, infinity}, high = -low;
      for (const Face& face : body.faces)
        for (const Vec& p : {face.a, face.b, face.c}) {
          low = {std::fmin(low.x, p.x), std::fmin(low.y, p.y), std::fmin(low.z, p.z)};
          high = {std::fmax(high.x, p.x), std::fmax(high.y, p.y), std::fmax(high.z, p.z)};
        }
      body.size = static_cast<float>(length(high - low));
    }
    body.closed = is_closed(body.faces);
    body.has_medium = has_medium(*body.material, body.closed);
    bodies_.push_back(std::move(body));
  }
  const Real half_height = std::tan(scene.camera.fov_deg * pi / 360);
  forward_ = unit(Vec(scene.camera.look_at) - Vec(scene.camera.position));
  right_ = unit(cross(forward_, scene.camera.up));
  up_ = half_height * cross(right_, forward_);
  right_ = half_height * right_;
}

Sample ReferenceTracer::sample(Real x, Real y, tracer::RenderStatistics& counted) const {
  const Real width = scene_.image.width, height = scene_.image.height;
  const Vec through = forward_ + ((2 * x - width) / height) * right_ + ((height - 2 * y) / height) * up_;
  Path path{counted};
  ++counted.samples;
  ++counted.rays.camera;
  const Ray ray{scene_.camera.position, unit(through), nullptr, nullptr, infinity, around_camera(path)};
  const Light3 radiance = trace(ray, {1, 1, 1}, 0, path);
  return {radiance, path.margin};
}

/// Objects whose first hit along a ray through the center of the image is on a back face, outermost first.
ReferenceTracer::Inside ReferenceTracer::around_camera(Path& path) const {
  Inside inside;
  std::vector<const Body*> seen;
  const Real kept = path.margin;
  Ray ray{scene_.camera.position, forward_};
  for (Hit hit = nearest(ray, path); hit.body != nullptr; hit = nearest(ray, path)) {
    const Point point = point_at(ray, hit);
    const bool first = std::find(seen.begin(), seen.end(), hit.body) == seen.end();
    if (first && point.back && hit.body->material->transmission > 0) inside.insert(inside.begin(), hit.body);
    seen.push_back(hit.body);
    ray = {point.position, forward_, hit.body, hit.face};
  }
  path.margin = kept;
  return inside;
}

std::vector<Sample> ReferenceTracer::image(tracer::RenderStatistics& counted) const {
  std::vector<Sample> pixels;
  for (std::uint32_t y = 0; y < scene_.image.height; ++y)
    for (std::uint32_t x = 0; x < scene_.image.width; ++x) pixels.push_back(sample(x + 0.5L, y + 0.5L, counted));
  return pixels;
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
  point.curved = point.position;
  if (hit.face != nullptr) {
    // Onto the mean of the corners' tangent planes, where these lie outside.
    const Face& f = *hit.face;
    const Real weights[] = {1 - hit.u - hit.v, hit.u, hit.v};
    const Vec corners[] = {f.a, f.b, f.c}, normals[] = {f.na, f.nb, f.nc};
    if (length(weights[0] * f.na + hit.u * f.nb + hit.v * f.nc) > 1e-6L)
      for (int i = 0; i < 3; ++i) {
        const Vec n = dot(normals[i], point.face_normal) < 0 ? -normals[i] : normals[i];
        const Real below = std::fmin(0.0L, dot(point.position - corners[i], n));
        point.curved = point.curved + (-below * weights[i]) * n;
      }
  }
  if (point.back) point.normal = -point.normal, point.face_normal = -point.face_normal;
  return point;
}

Light3 ReferenceTracer::color_at(const tracer::ColorOrTexture& color, const Point& point, Path& path) const {
  if (const auto* plain = std::get_if<tracer::Color>(&color)) return *plain;
  const tracer::Texture& texture = scene_.textures[std::get<tracer::TextureId>(color).index];
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

Light3 ReferenceTracer::trace(const Ray& ray, const Light3& weight, std::uint32_t depth, Path& path) const {
  const Hit hit = nearest(ray, path);
  if (hit.body == nullptr) return scene_.background.color;
  const Point point = point_at(ray, hit);
  const Inside after = beyond(ray.inside, point);
  if (hides(ray.inside, after, hit.body)) {  // a nested boundary: skipped
    if (depth >= *scene_.accuracy.max_depth) {
      ++path.counted.truncated_branches;
      return {};
    }
    ++path.counted.rays.refraction;
    return trace({point.position, ray.direction, hit.body, hit.face, infinity, after}, weight, depth + 1, path);
  }
  return local(ray, point, weight, path) + bounced(ray, point, weight, depth, path);
}

Light3 ReferenceTracer::local(const Ray& ray, const Point& point, const Light3& weight, Path& path) const {
  const Vec to_eye = -ray.direction;
  const tracer::Material& material = *point.hit.body->material;
  const Light3 color = color_at(material.color, point, path);
  const Light3 specular = color_at(material.specular_color, point, path);
  const Light3 through = material.diffuse_transmission * color_at(material.diffuse_transmission_color, point, path);
  const Interface side = interface_at(ray, point);
  const Real eta = material.transmission > 0 ? side.n_to / side.n_from : 1;
  Light3 sum = color_at(material.emission, point, path) + material.ambient * (color * Light3(scene_.ambient));
  for (const tracer::Light& light : scene_.lights) {
    const auto* const lamp = std::get_if<tracer::PointLight>(&light.source);
    const Vec offset = lamp != nullptr ? Vec(lamp->position) - point.position
                                       : -unit(std::get<tracer::DirectionalLight>(light.source).direction);
    const Vec to_light = unit(offset);
    const Real f = lamp != nullptr ? fade(light.attenuation, length(offset)) : 1, n_l = dot(point.normal, to_light);
    if (material.specular + material.specular_transmission > 0) path.near_miss(n_l);  // highlights are discontinuous
    if (material.specular_transmission > 0) path.near_miss(1 - (1 - n_l * n_l) * eta * eta);
    const Real shine = material.specular * highlight(material, point.normal, to_light, to_eye);
    const Real bent =
        material.specular_transmission * transmitted_highlight(material, point.normal, to_light, to_eye, eta);
    const Light3 reflected =
        n_l > 0 ? (material.diffuse * n_l) * color + shine * specular : -n_l * through + bent * specular;
    const Light3 unshadowed = (f * light.intensity) * (Light3(light.color) * reflected);
    if (n_l == 0 || largest(weight * unshadowed) == 0) continue;
    const Vec start = (n_l < 0) == point.back ? point.curved : point.position;
    Ray shadow{start, to_light, point.hit.body, point.hit.face, infinity, n_l < 0 ? side.after : ray.inside};
    if (lamp != nullptr)
      shadow.direction = unit(Vec(lamp->position) - start), shadow.end = length(Vec(lamp->position) - start);
    sum = sum + (light.shadows ? unshadowed * visible(shadow, path) : unshadowed);
  }
  return color_at(material.opacity, point, path) * sum;
}

/// S: the product over every surface along the shadow ray.
Light3 ReferenceTracer::visible(Ray ray, Path& path) const {
  ++path.counted.rays.shadow;
  Light3 through{1, 1, 1};
  for (Hit hit = nearest(ray, path); hit.body != nullptr; hit = nearest(ray, path)) {
    const tracer::Material& material = *hit.body->material;
    const Point crossed = point_at(ray, hit);
    const Inside after = beyond(ray.inside, crossed);
    const Light3 passed = material.transmission * color_at(material.transmission_color, crossed, path) +
                          Light3{1, 1, 1} + -1 * color_at(material.opacity, crossed, path);
    if (!hides(ray.inside, after, hit.body)) through = through * passed;
    ray = {ray.origin + hit.t * ray.direction, ray.direction, hit.body, hit.face, ray.end - hit.t, after};
  }
  return through;
}

Light3 ReferenceTracer::bounced(const Ray& ray, const Point& point, const Light3& weight, std::uint32_t depth,
                                Path& path) const {
  const tracer::Material& material = *point.hit.body->material;
  const Light3 there = color_at(material.opacity, point, path), missing = Light3{1, 1, 1} + -1 * there;
  const Vec d = ray.direction;
  const Vec n = dot(d, point.normal) < 0 ? point.normal : point.face_normal;
  const Real cos_i = -dot(d, n);
  const auto [after, n_from, n_to] = interface_at(ray, point);
  // Snell's law by the part of d along the surface: sin_t / sin_i = n_from / n_to.
  const Vec along = (n_from / n_to) * (d + cos_i * n);
  const Real cos2_t = 1 - dot(along, along);
  const bool total = cos2_t <= 0;
  const Real cos_t = total ? 0 : std::sqrt(cos2_t);
  Light3 mirror = material.reflection * (there * color_at(material.reflection_color, point, path));
  Light3 transmit = material.transmission * color_at(material.transmission_color, point, path);
  if (material.transmission > 0 || material.fresnel) path.near_miss(cos2_t / std::fmax(1.0L, n_from / n_to));
  if (material.fresnel) {
    const Real f = total ? 1 : n_from == n_to ? 0 : reflectance(cos_i, cos_t, n_from, n_to);
    mirror = f * mirror;
    transmit = (1 - f) * transmit;
  } else if (total) {
    mirror = mirror + transmit;
  }
  if (total) transmit = {};
  const auto above = [](const Vec& v, const Vec& face) { return v + std::fmax(0.0L, -2 * dot(v, face)) * face; };
  const Vec mirrored = above(unit(d + 2 * cos_i * n), point.face_normal);
  const Vec onward = above(material.transmission > 0 ? unit(along - cos_t * n) : d, -point.face_normal);
  return follow(point, onward, after, weight, transmit + missing, depth, path.counted.rays.refraction, path) +
         follow(point, mirrored, ray.inside, weight, mirror, depth, path.counted.rays.reflection, path);
}

Light3 ReferenceTracer::follow(const Point& point, const Vec& direction, const Inside& inside, const Light3& weight,
                               const Light3& factor, std::uint32_t depth, std::uint64_t& kind, Path& path) const {
  if (largest(factor) == 0) return {};
  const Light3 arriving = weight * factor;
  if (const double cutoff = *scene_.accuracy.cutoff; cutoff > 0) path.near_miss(largest(arriving) / cutoff - 1);
  if (largest(arriving) < *scene_.accuracy.cutoff || largest(arriving) == 0) {
    ++path.counted.cut_branches;
    return {};
  }
  if (depth >= *scene_.accuracy.max_depth) {
    ++path.counted.truncated_branches;
    return {};
  }
  ++kind;
  const Ray ray{point.position, direction, point.hit.body, point.hit.face, infinity, inside};
  return factor * trace(ray, arriving, depth + 1, path);
}

}  // namespace oracle
