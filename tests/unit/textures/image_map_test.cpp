// Image textures: texels, wrap modes, interpolation, mip maps.
#include "tracer/src/textures/image_map.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using Wrap = Texture::Wrap;

Image make_image(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
  Random random(seed);
  Image image{width, height, {}};
  for (std::uint32_t i = 0; i < 3 * width * height; ++i) image.rgb.push_back(static_cast<float>(random.in(0, 1)));
  return image;
}

/// Index of the texel of the image continued over the plane, the slow way.
std::uint32_t continued(Wrap wrap, long index, long n) {
  if (wrap == Wrap::clamp) return static_cast<std::uint32_t>(std::clamp(index, 0L, n - 1));
  const long period = wrap == Wrap::repeat ? n : 2 * n;
  const long rest = ((index % period) + period) % period;
  return static_cast<std::uint32_t>(rest < n ? rest : 2 * n - 1 - rest);
}

Real expected_bilinear(const Image& image, double u, double v, const Wraps& wraps) {
  const Real x = Real(u) * image.width - 0.5L, y = Real(v) * image.height - 0.5L;
  const long i = static_cast<long>(std::floor(x)), j = static_cast<long>(std::floor(y));
  const auto red = [&](long a, long b) {
    return Real(
        image.pixel(continued(wraps.u, a, image.width), image.height - 1 - continued(wraps.v, b, image.height))[0]);
  };
  const Real s = x - std::floor(x), t = y - std::floor(y);
  return (1 - t) * ((1 - s) * red(i, j) + s * red(i + 1, j)) + t * ((1 - s) * red(i, j + 1) + s * red(i + 1, j + 1));
}

TEST(ImageMap, InterpolatesBetweenTexelCentresUnderEveryWrap) {
  Random random(1);
  const Image image = make_image(7, 5, 2);
  const ImageMap map(image);
  for (std::uint64_t i = 0; i < effort::cases(50'000); ++i) {
    const Wraps wraps{static_cast<Wrap>(random.below(3)), static_cast<Wrap>(random.below(3))};
    const double u = random.in(-5, 5), v = random.in(-5, 5);
    ASSERT_NEAR(map.bilinear({u, v}, wraps).r, static_cast<double>(expected_bilinear(image, u, v, wraps)), 1e-12)
        << u << " " << v << " " << static_cast<int>(wraps.u) << static_cast<int>(wraps.v);
    const long x = static_cast<long>(std::floor(Real(u) * 7)), y = static_cast<long>(std::floor(Real(v) * 5));
    ASSERT_EQ(map.nearest({u, v}, wraps).r, image.pixel(continued(wraps.u, x, 7), 4 - continued(wraps.v, y, 5))[0])
        << u << " " << v;
  }
}

TEST(ImageMap, AcceptsAnyCoordinate) {
  const ImageMap map(make_image(7, 5, 3));
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror})
    for (double x = 1e-300; x < 1e300; x *= 1e7)
      for (const double u : {x, -x}) {
        const Color color = map.trilinear({u, -u}, {x, x}, {wrap, wrap});
        EXPECT_TRUE(color.r >= 0 && color.r <= 1) << u;
        EXPECT_TRUE(map.nearest({u, -u}, {wrap, wrap}).r >= 0) << u;
      }
}

TEST(ImageMap, HasTheSameMeanOnEveryLevelWhateverItsSize) {
  for (const auto& [width, height] : {std::pair{64u, 64u}, {37u, 53u}, {1u, 17u}, {100u, 1u}, {5u, 2u}}) {
    const ImageMap map(make_image(width, height, width));
    std::vector<double> means;
    for (const Image& level : map.levels()) {
      double sum = 0;
      for (std::size_t i = 0; i < level.rgb.size(); i += 3) sum += level.rgb[i];
      const std::size_t texels = level.rgb.size() / 3;
      means.push_back(sum / static_cast<double>(texels));
    }
    EXPECT_EQ(map.levels().back().rgb.size(), 3u);
    for (const double mean : means) EXPECT_NEAR(mean, means.front(), 1e-6) << width << " x " << height;
  }
}

TEST(ImageMap, SelectsCoarserLevelsForLargerWidths) {
  const ImageMap map(make_image(16, 16, 4));
  const Vec2 at{0.3, 0.6};
  EXPECT_EQ(map.trilinear(at, {}, {}), map.bilinear(at, {}));
  EXPECT_EQ(map.trilinear(at, {1.0 / 16, 0}, {}), map.bilinear(at, {}));
  const Color whole = map.trilinear(at, {1, 1}, {});
  EXPECT_EQ(whole.r, map.levels().back().rgb[0]) << "the whole make_image: its mean";
  EXPECT_EQ(map.trilinear(at, {50, 0}, {}), whole);
  const ImageMap half(map.levels()[1]);
  EXPECT_EQ(map.trilinear(at, {2.0 / 16, 0}, {}), half.bilinear(at, {}));
  const double t = std::log2(3.0) - 1;
  const double between = half.bilinear(at, {}).r * (1 - t) + ImageMap(map.levels()[2]).bilinear(at, {}).r * t;
  EXPECT_NEAR(map.trilinear(at, {0, 3.0 / 16}, {}).r, between, 1e-12);
}

}  // namespace
}  // namespace tracer
