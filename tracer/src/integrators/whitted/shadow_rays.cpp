#include "tracer/src/integrators/whitted/shadow_rays.h"

#include <limits>
#include <numeric>
#include <utility>

#include "tracer/src/math/rounding.h"

namespace tracer {
namespace {

/// Beside a IntersectionPacket: shadow rays that go on behind transmissive surfaces.
struct alignas(64) Onward {
  double ox[lanes], oy[lanes], oz[lanes];
  double left[lanes];  ///< of the way to the light
  std::uint32_t number[lanes];
  MediumStack::List media[lanes];
};

/// Where they start, and which surfaces are met from behind.
WHITTLE_WIDE void start_behind(IntersectionPacket& __restrict places, Onward& __restrict to) {
  const PointPacket& p = places.points;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction{places.direction_x[i], places.direction_y[i], places.direction_z[i]};
    const Vec3 face{p.face_x[i], p.face_y[i], p.face_z[i]};
    const double clearance =
        std::abs(face.x) * p.error_x[i] + std::abs(face.y) * p.error_y[i] + std::abs(face.z) * p.error_z[i];
    const Vec3 origin = clear_of({p.x[i], p.y[i], p.z[i]}, face, clearance, direction);
    to.ox[i] = origin.x;
    to.oy[i] = origin.y;
    to.oz[i] = origin.z;
    places.behind[i] = direction.x * face.x + direction.y * face.y + direction.z * face.z > 0 ? 1 : 0;
  }
}

/// Makes room for `count` behind the first `used`.
void make_room(std::vector<double>& values, std::size_t used, std::size_t count) {
  if (values.size() < used + count) values.resize(2 * used + count);
}

}  // namespace

void ShadowRays::append(const ShadingPointPacket& packet, const LightSamplePacket& a) {
  const std::size_t first = rays_.size();
  rays_.append({a.origin_x, a.origin_y, a.origin_z, a.to_x, a.to_y, a.to_z, a.r, a.g, a.b, packet.sample, packet.from,
                nullptr, packet.media},
               a.gaining);
  make_room(distance_, first, lanes);
  // Short of the light by more than the rounding of its distance, so that what a light sits on does not hide it.
  double short_of_it[lanes];
  for (int i = 0; i < lanes; ++i) short_of_it[i] = a.distance[i] * (1 - 0x1p-40);
  const Compressed distances{short_of_it, &distance_[first]};
  compress_eights(&distances, 1, a.gaining);
}

void ShadowRays::add_to(std::vector<Color>& radiance, MediumStack& media, Coherence coherence) {
  if (rays_.empty()) return;
  blocked_.resize(rays_.size());
  scene_.accelerator->occluded(rays_.span(distance_.data()), blocked_.data(), coherence);
  const bool transmissive = needs_.transmissive_shadows;
  if (transmissive) cross_transmissive(media);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (blocked_[i] != 0) continue;
    radiance[rays_.sample(i)] += transmissive ? rays_.throughput(i) * visible_[i] : rays_.throughput(i);
  }
}

/// S_i of the rays that no opaque surface blocks: the product of K_t C_t over every surface on the way to the light,
/// and of the absorption between them, in the order they are crossed.
void ShadowRays::cross_transmissive(MediumStack& media) {
  const std::size_t count = rays_.size();
  visible_.assign(count, {1, 1, 1});
  if (number_.size() < count) {
    number_.resize(count);
    std::iota(number_.begin(), number_.end(), 0u);
  }
  // Those that are blocked stay where they are, with an end that lets them meet nothing.
  for (std::size_t i = 0; i < count; ++i)
    distance_[i] = blocked_[i] != 0 ? std::numeric_limits<double>::quiet_NaN() : distance_[i];
  cross_one_each({rays_, distance_.data(), number_.data()}, media);
  for (std::uint64_t crossings = 1; !next_.empty(); ++crossings) {
    if (crossings > scene_.max_transmissive_hits || control_.cancelled()) break;
    std::swap(crossing_, next_);
    std::swap(crossing_distance_, next_distance_);
    cross_one_each({crossing_, crossing_distance_.data(), crossing_.carried().sample}, media);
  }
}

/// Up to the first transmissive surface of each and through it; `next_` are those that go on from there.
void ShadowRays::cross_one_each(const OnTheWay& from, MediumStack& media) {
  const std::size_t count = from.rays.size();
  scene_.accelerator->intersect(from.rays.span(from.distance), crossed_.room_for(count), Coherence::coherent,
                                GeometryMask::transmissive);
  if (met_.size() < count) met_.resize(count);
  std::size_t met = 0;
  for (std::size_t i = 0; i < count; ++i) {
    met_[met] = static_cast<std::uint32_t>(i);
    met += crossed_.primitive[i].hit() ? 1 : 0;
  }
  for (std::size_t i = 0; needs_.absorption && i < count; ++i) {
    Color& visible = visible_[from.number[i]];
    const double length = crossed_.primitive[i].hit() ? crossed_.t[i] : from.distance[i];
    visible = visible * media.transmittance(from.rays.media(i), length);
  }
  next_.clear();
  for (std::size_t first = 0; first < met; first += lanes) {
    load(from.rays, crossed_.span(), met_.data() + first, static_cast<int>(std::min<std::size_t>(lanes, met - first)),
         places_);
    cross_packet(from, media);
  }
}

void ShadowRays::cross_packet(const OnTheWay& from, MediumStack& media) {
  Onward onward;
  const PointPacket& points = places_.points;
  meet_points(scene_.geometry(), places_.met, places_.points);
  start_behind(places_, onward);
  LaneMask going = 0;
  for (int i = 0; i < places_.count; ++i) {
    const auto ray = static_cast<std::size_t>(places_.ray[i]);
    const std::uint32_t object = points.object[i];
    MediumStack::Crossing crossing{.after = from.rays.media(ray)};
    if (needs_.absorption || needs_.overlapping_media)
      crossing = media.cross(crossing.after, object, places_.behind[i] > 0);
    Color& visible = visible_[from.number[ray]];
    if (!crossing.hidden) visible = visible * scene_.terms[scene_.material_of_object[object]].through;
    onward.number[i] = from.number[ray];
    onward.media[i] = crossing.after;
    onward.left[i] = from.distance[ray] - crossed_.t[ray];
    if (!is_black(visible) && onward.left[i] > 0) going |= LaneMask{1} << i;
  }
  const std::size_t end = next_.size();
  // Their weights are the shadow rays' own.
  next_.append({onward.ox, onward.oy, onward.oz, places_.direction_x, places_.direction_y, places_.direction_z,
                onward.left, onward.left, onward.left, onward.number, places_.met.primitive, nullptr, onward.media},
               going);
  make_room(next_distance_, end, lanes);
  const Compressed distances{onward.left, &next_distance_[end]};
  compress_eights(&distances, 1, going);
}

}  // namespace tracer
