#pragma once
/// How accurate an image is to be, and how accurate it became.
///
/// Errors are in levels: the root mean square, over all pixels and channels, of the difference from the converged
/// image of the same scene, after exposure, overflow and the sRGB curve, in units of 1/255. What is transparent
/// counts as black. The converged image is the mean over each pixel's square, lens and lights, without `max_depth`,
/// `cutoff` or approximations.

#include <cstdint>
#include <optional>

namespace tracer {

/// More lights than any scene may have.
inline constexpr std::uint32_t nearest_lights_max = 1'000'000;

/// Cheaper models that a user asks for by name, to trade accuracy for time. None is on by default.
struct Approximations {
  /// none: every light shines through everything. map: what a light sees is traced once into a depth map, and asked
  /// instead of tracing a ray; of opaque surfaces alone, and from a soft light's middle.
  enum class Shadows { exact, none, map };
  /// environment: a mirror or glass sees the background alone, as though nothing were on the way. none: it sees
  /// nothing.
  enum class Reflections { exact, environment, none };
  /// Every material is shaded so, whatever it says.
  enum class Shading { exact, gouraud, flat };
  Shadows shadows = Shadows::exact;
  Reflections reflections = Reflections::exact;
  Shading shading = Shading::exact;
  /// Each hit is lit by so many of the lights nearest to it, at most nearest_lights_max; 0: by all. Directional lights
  /// are everywhere: they light every hit and are not among those counted.
  std::uint32_t nearest_lights = 0;
  bool operator==(const Approximations&) const = default;
  [[nodiscard]] bool any() const { return *this != Approximations{}; }
};

/// Samples where they lower the error most, until the estimate of the error is at most `target_error`, or the time is
/// over, whichever comes first. Neither set: until `samples_max`.
struct Adaptive {
  std::optional<double> target_error;  ///< levels, > 0
  /// Of building and tracing, > 0. Where there is no time for a sample in every pixel and to go on from there, the
  /// image is a sketch: samples of a grid of pixels, each standing for a block of them, at the least one for all. Its
  /// error is what fresh samples in a few of the pixels tell; the least number of samples in a pixel is then 0.
  std::optional<double> time_budget_ms;
  std::uint32_t samples_min = 1;  ///< in each pixel
  /// In each pixel. Default: enough for a feature of 1/4000 pixel, few enough that one pixel does not take the night.
  std::uint32_t samples_max = 4096;
  bool operator==(const Adaptive&) const = default;
};

/// Target errors by name.
enum class Preset { draft, standard, fine, reference };

/// What a preset stands for, in levels. draft: to see whether everything is in its place. standard: what is left is
/// within the step between two codes of 8 bits. fine: within their rounding. reference: to compare others with.
double target_error_of(Preset preset);

struct Accuracy {
  /// Where it does not adapt: exactly this many in every pixel. 1 is the pixel's centre; more are stratified over the
  /// pixel's square. Default 4: the smallest count that smooths an edge.
  std::uint32_t samples = 4;
  /// Where it does not adapt: levels that the estimate is compared with in the end. Changes nothing in the image.
  std::optional<double> target_error;
  std::optional<Adaptive> adaptive;
  std::uint32_t max_depth = 64;  ///< secondary bounces; the safety net behind `cutoff`
  /// A branch whose throughput (largest channel) is below this is not traced. Default 1/1000: a quarter of an 8-bit
  /// step.
  double cutoff = 1e-3;
  /// Such a branch is traced all the same with a probability in proportion to its weight, and then counts for those
  /// that were not (Russian roulette: Arvo & Kirk 1990): the mean is what it would be without a cutoff, and what is
  /// missing becomes noise, which samples tell and lower. The document's default where it asks for an error or a time.
  bool cutoff_by_chance = false;
  std::uint64_t seed = 0;
  Approximations approximate{};
  bool operator==(const Accuracy&) const = default;

  /// What is asked for, whether the samples follow it or not.
  [[nodiscard]] std::optional<double> target() const { return adaptive ? adaptive->target_error : target_error; }
};

/// What is known of the error of a rendered image. All errors in levels.
struct ErrorEstimate {
  /// At the stated confidence the true error is at most this.
  double estimate = 0;
  double confidence = 0.95;
  std::optional<double> target;  ///< as asked
  bool met = true;               ///< estimate <= target; true without a target
  double sampling = 0;           ///< part of too few samples
  double depth = 0;              ///< part of branches that `max_depth` ended, at most
  double cutoff = 0;             ///< part of branches and shadow rays that `cutoff` spared, at most
  /// Part of what was asked for as approximation, measured against exact samples of some pixels.
  double approximation = 0;
  /// Whether `depth` and `cutoff` are bounds. Not so where no bound on the scene's radiance exists (a light that falls
  /// off with the inverse square, a solid that gives back all it receives and more): there the largest radiance that
  /// was met takes its place.
  bool bounded = true;
};

}  // namespace tracer
