/// Previews of an image while it is traced.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <vector>

#include "tests/support/scenes.h"
#include "tracer/control.h"
#include "tracer/render.h"

using namespace tracer;

namespace {

constexpr std::uint32_t side = 100;  // a multiple neither of a tile nor of the preview's size

Scene exact(std::uint32_t samples) {
  Scene scene = scenes::random(3, side);
  scene.accuracy.samples = samples;
  return scene;
}

Scene adaptive() {
  Scene scene = scenes::random(3, side);
  scene.accuracy.adaptive.emplace().target_error = 0.3;
  scenes::end_by_chance(scene);
  return scene;
}

std::size_t known(const Image& image) {
  return static_cast<std::size_t>(std::count(image.alpha.begin(), image.alpha.end(), 1.0f));
}

/// Renders while another thread takes previews continuously and passes each of them to `see`.
template <class See>
Rendered render_watched(const Scene& scene, std::uint32_t look_side, const See& see) {
  RenderControl control;
  Preview preview;
  const auto compiled = scenes::compiled(scene);
  std::atomic<bool> done = false;
  std::thread watcher([&] {
    while (!done) {
      if (const auto image = preview.snapshot(look_side)) see(*image);
    }
  });
  auto rendered = render(*compiled, {.threads = 2, .preview = &preview}, control);
  done = true;
  watcher.join();
  EXPECT_FALSE(preview.snapshot(look_side)) << "it is over";
  return std::move(*rendered);
}

}  // namespace

TEST(Preview, IsEmptyWithoutARender) {
  Preview preview;
  EXPECT_FALSE(preview.snapshot(64));
}

TEST(Preview, DoesNotChangeTheImage) {
  for (const Scene& scene : {exact(4), adaptive()}) {
    const Rendered alone = scenes::render(scene, 2);
    const Rendered watched = render_watched(scene, 64, [](const Image&) {});
    EXPECT_EQ(watched.image.rgb, alone.image.rgb);
    EXPECT_EQ(watched.statistics.rays.total(), alone.statistics.rays.total());
    EXPECT_EQ(watched.error.estimate, alone.error.estimate);
  }
}

TEST(Preview, OfUniformSamplingEqualsTheImageInTracedPixels) {
  const Scene scene = exact(24);
  const Rendered rendered = scenes::render(scene, 2);
  std::size_t looks = 0, last = 0;
  render_watched(scene, side, [&](const Image& image) {
    ++looks;
    ASSERT_EQ(image.width, side);
    ASSERT_EQ(image.height, side);
    EXPECT_GE(known(image), last) << "it only grows";
    last = known(image);
    for (std::size_t at = 0; at < image.alpha.size(); ++at) {
      if (image.alpha[at] == 0) continue;
      for (std::size_t i = 3 * at; i < 3 * at + 3; ++i) ASSERT_EQ(image.rgb[i], rendered.image.rgb[i]);
    }
  });
  EXPECT_GT(looks, 0u);
  EXPECT_GT(last, 0u);
}

TEST(Preview, IsTheMeanOverTheAreaOfItsPixel) {
  Scene scene = exact(32);
  scene.image.width = 2 * side;
  const Rendered rendered = scenes::render(scene, 2);
  std::size_t compared = 0;
  render_watched(scene, side, [&](const Image& image) {
    ASSERT_EQ(image.width, side);
    ASSERT_EQ(image.height, side / 2);
    for (std::uint32_t y = 0; y < image.height; ++y)
      for (std::uint32_t x = 0; x < image.width; ++x) {
        if (image.alpha[std::size_t{y} * image.width + x] == 0) continue;
        const float* const one = rendered.image.pixel(2 * x, 2 * y);
        const float* const below = rendered.image.pixel(2 * x, 2 * y + 1);
        const float mean = (one[0] + one[3] + below[0] + below[3]) / 4;
        ASSERT_NEAR(image.pixel(x, y)[0], mean, 1e-6f * std::abs(mean));
        ++compared;
      }
  });
  EXPECT_GT(compared, 0u);
}

TEST(Preview, OfAdaptiveSamplingConvergesToTheImage) {
  Scene scene = adaptive();
  scene.accuracy.adaptive->samples_min = 64;
  const Rendered rendered = scenes::render(scene, 2);
  std::vector<double> errors;
  // A busy machine may show a single state of the image.
  for (int attempt = 0; attempt < 200 && errors.size() < 2; ++attempt) {
    errors.clear();
    render_watched(scene, side, [&](const Image& image) {
      if (known(image) < image.alpha.size()) return;
      double squares = 0;
      for (std::size_t i = 0; i < image.rgb.size(); ++i) {
        ASSERT_TRUE(std::isfinite(image.rgb[i]));
        squares += std::pow(std::min(1.0f, image.rgb[i]) - std::min(1.0f, rendered.image.rgb[i]), 2);
      }
      if (errors.empty() || squares != errors.back()) errors.push_back(squares);
    });
  }
  ASSERT_GE(errors.size(), 2u) << "every pixel has its pilot long before the end";
  EXPECT_LT(errors.back(), errors.front());
}

TEST(Preview, OfALongWindowIsAtLeastOnePixelHigh) {
  Scene scene = exact(1024);  // long enough for several previews
  scene.image.width = 900;
  scene.image.height = 3;
  std::size_t looks = 0;
  render_watched(scene, 100, [&](const Image& image) {
    ++looks;
    EXPECT_EQ(image.width, 100u);
    EXPECT_EQ(image.height, 1u);
  });
  EXPECT_GT(looks, 0u);
}
