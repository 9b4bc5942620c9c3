#include "tracer/src/integrators/whitted/diffuse_rays.h"

#include <numbers>

namespace tracer {
namespace {

/// Hashes of shuffled_point() for a choice: its key and the place in the sequence.
struct alignas(64) SequencePlaces {
  std::uint64_t key[lanes];
  std::uint32_t place[lanes];
};

WHITTLE_INLINE void find_places(const RandomPacket& __restrict random, Choice choice, SequencePlaces& __restrict to) {
  std::uint32_t seed[lanes];
  for (int i = 0; i < lanes; ++i) {
    const std::uint64_t dimension = std::uint64_t{random.path[i]} << 32 | static_cast<std::uint32_t>(choice);
    to.key[i] = mix(random.key[i] ^ mix(dimension));
    seed[i] = static_cast<std::uint32_t>(mix(to.key[i]));
  }
  for (int i = 0; i < lanes; ++i) to.place[i] = owen_scrambled(random.index[i], seed[i]);
}

/// Places on the incident side.
WHITTLE_INLINE void set_places(const ShadingPointPacket& __restrict f, const double* __restrict back_face,
                               ReceiverPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 outward = f.face[i] * (1 - 2 * back_face[i]);
    to.normal.set(i, f.normal[i]);
    to.outward.set(i, outward);
    to.origin.set(i, clear_of(f.position[i], outward, f.clearance[i], outward));
  }
}

/// choose_branch() for a number of branches, whose loops unroll.
template <std::size_t count>
WHITTLE_INLINE void choose(const double* __restrict weight, const double* __restrict random,
                           SecondaryRayPacket* const* branches) {
  double own[count][lanes], left[lanes], whole[lanes];
  for (std::size_t b = 0; b < count; ++b)
    for (int i = 0; i < lanes; ++i) own[b][i] = (branches[b]->going >> i & 1) != 0 ? branches[b]->largest[i] : 0;
  for (int i = 0; i < lanes; ++i) {
    double sum = 0;
    for (std::size_t b = 0; b < count; ++b) sum += own[b][i];
    whole[i] = sum > weight[i] ? sum : weight[i];
    left[i] = whole[i] * random[i];
  }
  for (std::size_t b = 0; b < count; ++b) {
    SecondaryRayPacket& branch = *branches[b];
    LaneMask kept = 0;
    for (int i = 0; i < lanes; ++i) {
      const bool after_diffuse = weight[i] > 0, chosen = (left[i] >= 0) & (left[i] < own[b][i]);
      const double factor = after_diffuse & chosen ? whole[i] / own[b][i] : 1;
      branch.throughput.set(i, branch.throughput[i] * factor);
      branch.largest[i] *= factor;
      left[i] -= own[b][i];
      kept |= lane_bit(i, !after_diffuse | chosen);
    }
    branch.going &= kept;
  }
}

}  // namespace

WHITTLE_WIDE void random_numbers(const RandomPacket& __restrict random, Choice choice, double* __restrict to) {
  SequencePlaces at;
  find_places(random, choice, at);
  for (int i = 0; i < lanes; ++i)
    to[i] = owen_scrambled_reverse(at.place[i], static_cast<std::uint32_t>(at.key[i])) * 0x1p-32;
}

WHITTLE_WIDE void random_points(const RandomPacket& __restrict random, Choice choice, PointLanes& __restrict to) {
  SequencePlaces at;
  find_places(random, choice, at);
  for (int i = 0; i < lanes; ++i) {
    to.x[i] = owen_scrambled_reverse(at.place[i], static_cast<std::uint32_t>(at.key[i])) * 0x1p-32;
    const std::uint32_t second = sobol_second_reverse(at.place[i]);
    to.y[i] = owen_scrambled_reverse(second, static_cast<std::uint32_t>(at.key[i] >> 32)) * 0x1p-32;
  }
}

WHITTLE_WIDE void begin_diffuse(const HitPacket& __restrict hit, const ShadingPointPacket& __restrict shading_points,
                                SecondaryRayPacket& __restrict rays, ReceiverPacket& __restrict places) {
  set_places(shading_points, hit.back_face, places);
  LaneMask going = 0;
  for (int i = 0; i < lanes; ++i) {
    const Color c = shading_points.diffuse[i];
    const double larger = c.r > c.g ? c.r : c.g;
    rays.throughput.set(i, c);
    rays.largest[i] = larger > c.b ? larger : c.b;
    going |= lane_bit(i, rays.largest[i] > 0);
  }
  for (int i = 0; i < lanes; ++i) rays.path[i] = diffuse_path(hit.path[i]);
  rays.going = going & first_lanes(hit.count);
}

WHITTLE_WIDE LaneMask weigh_samples(const ReceiverPacket& __restrict places,
                                    const Emitters::SamplePacket& __restrict samples,
                                    const ColorLanes& __restrict diffuse, const double* __restrict search,
                                    ColorLanes& __restrict throughput) {
  LaneMask above = 0;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction = samples.direction[i];
    const double cosine = dot(places.normal[i], direction), density = samples.density[i];
    const double own = cosine / std::numbers::pi;
    throughput.set(i, diffuse[i] * (own / (search[i] * own + density)));
    above |= lane_bit(i, (cosine > 0) & (dot(direction, places.outward[i]) > 0) & (density > 0));
  }
  return above;
}

WHITTLE_WIDE LaneMask aim_diffuse(const ReceiverPacket& __restrict places, const PointLanes& __restrict points,
                                  VecLanes& __restrict directions, double* __restrict density) {
  LaneMask above = 0;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 local = cosine_direction({points.x[i], points.y[i]});
    const Axes axes = axes_about(places.normal[i]);
    const Vec3 direction = unit(axes.e0 * local.x + axes.e1 * local.y + axes.n * local.z);
    directions.set(i, direction);
    density[i] = local.z / std::numbers::pi;
    above |= lane_bit(i, dot(direction, places.outward[i]) > 0);
  }
  return above;
}

WHITTLE_WIDE void choose_branch(const double* __restrict weight, const double* __restrict random,
                                std::span<SecondaryRayPacket* const> branches) {
  if (branches.size() == 3) {
    choose<3>(weight, random, branches.data());
  } else {
    choose<4>(weight, random, branches.data());
  }
}

}  // namespace tracer
