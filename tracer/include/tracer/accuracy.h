#pragma once
/// Requested accuracy of an image, and the error estimate of the result.
///
/// Errors are in levels: the root mean square over all pixels and channels of the difference from the converged image
/// of the same scene, after exposure, overflow and the sRGB curve, in units of 1/255. Transparent parts count as
/// black. The converged image is the mean over each pixel's square, lens and lights, without `max_depth`, `cutoff` or
/// approximations, of the light model of `Accuracy::model`.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "tracer/document_fields.h"

namespace tracer {

/// Larger than the number of lights of any accepted scene.
inline constexpr std::uint32_t nearest_lights_max = 1'000'000;

/// Cheaper models, each selected by name, that trade accuracy for time. None is on by default.
struct Approximations {
  /// none: no occlusion. map: depth maps, rendered once per light, replace shadow rays; they contain opaque surfaces
  /// only and represent an area light by its center.
  enum class Shadows { exact, none, map };
  /// environment: secondary rays return the background without being traced. none: they return black.
  enum class Reflections { exact, environment, none };
  /// Overrides the shading of every material.
  enum class Shading { exact, gouraud, flat };
  /// Light that arrives by way of diffuse surfaces, with Accuracy::Model::global. ambient: the ambient term stands for
  /// it, as in Accuracy::Model::whitted. none: it is left out. radiosity: it is found for patches of the surfaces, once
  /// for the scene, by a linear system (Goral, Torrance, Greenberg, Battaile 1984). gather: one diffuse ray finds the
  /// patches.
  enum class Interreflection { exact, gather, radiosity, ambient, none };
  Shadows shadows = Shadows::exact;
  Reflections reflections = Reflections::exact;
  Shading shading = Shading::exact;
  Interreflection interreflection = Interreflection::exact;
  /// Number of lights, nearest first, that are evaluated at each hit, at most nearest_lights_max; 0: all. Directional
  /// lights have no distance: they are always evaluated and not counted.
  std::uint32_t nearest_lights = 0;
  /// Principled surfaces of at most this roughness reflect and refract as smooth ones, with the same albedo: by one
  /// direction instead of those of their facets. Lights keep their highlights.
  double mirror_roughness = 0;
  bool operator==(const Approximations&) const = default;

  /// All but `lights`, which is "nearest-N". Exact is the absence of a field.
  static constexpr auto fields() {
    return std::tuple{
        Field{"shadows", &Approximations::shadows, FieldRange::any, FieldPresence::derived},
        Field{"reflections", &Approximations::reflections, FieldRange::any, FieldPresence::derived},
        Field{"shading", &Approximations::shading, FieldRange::any, FieldPresence::derived},
        Field{"interreflection", &Approximations::interreflection, FieldRange::any, FieldPresence::derived},
        optional_field("mirror_roughness", &Approximations::mirror_roughness, FieldRange::fraction())};
  }
  [[nodiscard]] bool any() const { return *this != Approximations{}; }
};
constexpr auto words_of(Approximations::Shadows) { return in_order(Approximations::Shadows::none, {"none", "map"}); }
constexpr auto words_of(Approximations::Reflections) {
  return in_order(Approximations::Reflections::environment, {"environment", "none"});
}
constexpr auto words_of(Approximations::Shading) {
  return in_order(Approximations::Shading::gouraud, {"gouraud", "flat"});
}
constexpr auto words_of(Approximations::Interreflection) {
  return in_order(Approximations::Interreflection::gather, {"gather", "radiosity", "ambient", "none"});
}

/// Adaptive sampling: samples go to the pixels where they reduce the error most, until the estimates are at most
/// `target_error` and `tile_error`, as far as given, or `time_budget_ms` is over, whichever comes first. With none of
/// them: until `samples_max`.
struct Adaptive {
  std::optional<double> target_error;  ///< levels, > 0
  /// Target for the error of the worst tile; levels, > 0. The error of the whole image is small if most of the image is
  /// plain, however visible the rest is.
  std::optional<double> tile_error{};
  /// Time for compiling and tracing, > 0. If it does not suffice for one sample per pixel, the pixels of a coarser
  /// grid are traced (at least one) and each fills a block; looks then estimate the error, and the minimum
  /// sample count of a pixel is 0.
  std::optional<double> time_budget_ms;
  std::uint32_t samples_min = 1;  ///< per pixel
  /// Per pixel. The default resolves a feature of 1/4000 pixel and bounds the time that one pixel can take.
  std::uint32_t samples_max = 4096;
  bool operator==(const Adaptive&) const = default;
};

/// Named target errors.
enum class Preset { draft, standard, fine, reference };
constexpr auto words_of(Preset first) { return in_order(first, {"draft", "standard", "fine", "reference"}); }

/// Target error of a preset, in levels. draft: for layout. standard: within one 8-bit step. fine: within 8-bit
/// rounding. reference: for comparison with other images.
constexpr double target_error_of(Preset preset) {
  constexpr double targets[] = {4, 1, 0.5, 0.25};
  return targets[static_cast<std::size_t>(preset)];
}

struct Accuracy {
  /// Light that arrives at a surface from elsewhere than the scene's lights.
  enum class Model {
    whitted,  ///< the ambient term stands for it (Whitted 1980)
    /// The rendering equation (Kajiya 1986): light from all other surfaces, emission and the background included. The
    /// ambient term is left out.
    global
  };
  Model model = Model::whitted;
  /// Samples in every pixel without `adaptive`. 1 is the pixel's center; more are stratified over its square.
  /// Default 4: the smallest count that smooths edges.
  std::uint32_t samples = 4;
  /// Without `adaptive`: levels that the final error estimate is compared with. It does not change the image.
  std::optional<double> target_error;
  std::optional<double> tile_error{};  ///< the same for the worst tile
  std::optional<Adaptive> adaptive;
  /// Secondary bounces, at most. None: Russian roulette ends long paths, see roulette_depth().
  std::optional<std::uint32_t> max_depth{};
  /// Rays with a throughput (maximum over RGB) below this are not traced. None: Russian roulette, see
  /// roulette_throughput.
  std::optional<double> cutoff{};
  std::uint64_t seed = 0;
  /// Bounds the error of the finished image for any scene: ErrorEstimate::proven. It does not change the image.
  bool proof = false;
  Approximations approximate{};
  bool operator==(const Accuracy&) const = default;

  /// The others are read together: they determine the kind of sampling.
  static constexpr auto fields() {
    return std::tuple{Field{"max_depth", &Accuracy::max_depth},
                      Field{"cutoff", &Accuracy::cutoff, FieldRange::fraction()},
                      optional_field("seed", &Accuracy::seed), optional_field("proof", &Accuracy::proof),
                      Field{"approximate", &Accuracy::approximate, FieldRange::any, FieldPresence::derived}};
  }

  /// True if, with these approximations, surfaces light each other.
  [[nodiscard]] bool has_interreflection(const Approximations& by) const {
    return model == Model::global && by.interreflection != Approximations::Interreflection::ambient &&
           by.interreflection != Approximations::Interreflection::none;
  }
  /// True if, with these approximations, the ambient term stands for light from diffuse surfaces.
  [[nodiscard]] bool has_ambient_term(const Approximations& by) const {
    return model == Model::whitted || by.interreflection == Approximations::Interreflection::ambient;
  }
  /// Russian roulette (Arvo & Kirk 1990, "Particle Transport and Image Synthesis"): without `cutoff`, a ray below this
  /// throughput is traced with a probability in proportion to its own, and then has this one. The mean is that of all
  /// rays, and the noise that of a hard cutoff of 1/1024 or less, with fewer rays.
  static constexpr double roulette_throughput = 1.0 / 128;
  /// Without `max_depth`, the bounce from which on rays keep the throughput of those before them: a surface that
  /// reflects 95 % ends one path in 20. From there on 2 paths of n end at the n-th bounce at least, so that between
  /// perfect mirrors as many bounces follow in the mean. The rays of fixed samples are bounded, and the noise of
  /// adaptive ones: between mirrors of 95 %, paths have 60 bounces in the mean and 12 % noise, or 115 and 1 %.
  [[nodiscard]] std::uint32_t roulette_depth() const { return adaptive && cutoff != 0.0 ? 512 : 40; }
  /// True if the document leaves out rays.
  [[nodiscard]] bool truncates() const { return max_depth || cutoff; }
  /// True if patches hold light between surfaces.
  [[nodiscard]] bool uses_patches() const {
    const Approximations::Interreflection by = approximate.interreflection;
    return model == Model::global &&
           (by == Approximations::Interreflection::radiosity || by == Approximations::Interreflection::gather);
  }
  /// Target errors of either kind of sampling: of the image and of the worst tile.
  [[nodiscard]] std::optional<double> target() const { return adaptive ? adaptive->target_error : target_error; }
  [[nodiscard]] std::optional<double> tile_target() const { return adaptive ? adaptive->tile_error : tile_error; }
};
constexpr auto words_of(Accuracy::Model first) { return in_order(first, {"whitted", "global"}); }

/// Error estimate of a rendered image. All errors in levels. A tile is a square of 16 x 16 pixels, counted from the
/// upper left corner of the rendered window and smaller at its right and lower border.
struct ErrorEstimate {
  /// Why sampling ended.
  enum class Limit {
    none,         ///< the number of samples was fixed
    target,       ///< every target is reached
    time_budget,  ///< the time budget is used, or the rest does not suffice for a round of samples
    samples_max,  ///< every pixel that needs more samples has `samples_max`
    fixed_parts,  ///< parts that samples do not lower (all but `sampling` and `tone`) leave no room for the rest
    invisible     ///< time is left, but the remaining error is estimated to be below 0.1 level
  };

  double estimate = 0;  ///< upper bound of the true error at `confidence`, from estimated variances: tight, no theorem
  /// Upper bound of the true error, with Accuracy::proof: a theorem at `confidence` for finite samples, under the
  /// assumptions of tracer/README.md. Infinity: nothing is proven.
  double proven = std::numeric_limits<double>::infinity();
  double confidence = 0.95;
  std::optional<double> target;         ///< as requested
  bool target_met = true;               ///< estimate <= target and worst_tile <= tile_target, each if it is requested
  double worst_tile = 0;                ///< estimated error of the tile with the largest one
  std::optional<double> tile_target{};  ///< as requested
  double sampling = 0;                  ///< part caused by the finite number of samples
  double depth = 0;                     ///< part caused by `max_depth`, measured with rays that are continued
  double cutoff = 0;                    ///< the same of `cutoff`: rays not traced, shadow rays culled
  /// Part caused by `approximate` and, with fixed samples, by filtering textures; measured with
  /// exact samples of some pixels.
  double approximation = 0;
  double approximation_min = 0;  ///< lower bound of the same part at `confidence`; 0 if none was measured
  double tone = 0;               ///< part caused by the brightest pixel's error, with `overflow: scale`
  /// False if rays were left out and the scene's radiance has no bound (a light with inverse-square attenuation, a
  /// solid with an albedo >= 1). If no continued ray finds light, the largest radiance in the image counts instead.
  bool bounded = true;
  std::uint64_t looks = 0;  ///< pairs of fresh, independent half samples that validated pixels
  Limit limit = Limit::none;
};

}  // namespace tracer
