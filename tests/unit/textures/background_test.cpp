// Environments and cube maps, by direction and footprint, compared with their definitions.
#include "tracer/src/textures/background.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

namespace tracer {
namespace {

using Images = std::vector<std::shared_ptr<const ImageMap>>;

constexpr double pi = std::numbers::pi;
constexpr Vec3 up{0, 1, 0};

/// The image whose pixel in column x and row y has the color `color_at(x, y)`.
std::shared_ptr<const ImageMap> image_of(std::uint32_t width, std::uint32_t height,
                                         const std::function<Color(double, double)>& color_at) {
  Image image{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const Color color = color_at(x, y);
      for (const double channel : {color.r, color.g, color.b}) image.rgb.push_back(static_cast<float>(channel));
    }
  return std::make_shared<const ImageMap>(std::move(image));
}

bool is_even(double number) { return std::fmod(number, 2) == 0; }

CompiledBackground around(const Texture& texture, double rotation_deg = 0, const Vec3& world_up = up,
                          std::shared_ptr<const ImageMap> image = nullptr) {
  Background background;
  background.environment = Environment{{0}, rotation_deg};
  return {background, world_up, {texture}, Images{std::move(image)}};
}

Texture imaged(Texture::Filter filter = Texture::Filter::mipmap) {
  Texture texture;
  texture.pattern = ImageTexture{};
  texture.filter = filter;
  return texture;
}

/// Red is the column, green the row, in whole numbers.
CompiledBackground numbered(double rotation_deg = 0, const Vec3& world_up = up) {
  static const auto image = image_of(8, 4, [](double x, double y) { return Color{x, y, 0}; });
  return around(imaged(Texture::Filter::nearest), rotation_deg, world_up, image);
}

/// Longitude to the right of -z, latitude towards +y.
Vec3 towards(double longitude, double latitude) {
  return {std::sin(longitude) * std::cos(latitude), std::sin(latitude), -std::cos(longitude) * std::cos(latitude)};
}

TEST(EnvironmentBackground, HasItsMiddleAtMinusZItsRightHalfToTheRightAndItsTopRowAbove) {
  const CompiledBackground sky = numbered();
  const double little = 0.01;
  EXPECT_EQ(sky.radiance(towards(little, little), 0), (Color{4, 1, 0}));
  EXPECT_EQ(sky.radiance(towards(-little, -little), 0), (Color{3, 2, 0}));
  EXPECT_EQ(sky.radiance(towards(pi / 2 + little, pi / 2 - little), 0), (Color{6, 0, 0}));
  EXPECT_EQ(sky.radiance(towards(pi - little, little - pi / 2), 0), (Color{7, 3, 0}));
  EXPECT_EQ(sky.radiance(towards(little - pi, 0.1), 0), (Color{0, 1, 0}));
}

TEST(EnvironmentBackground, TurnsWithItsRotationCounterClockwiseSeenFromAbove) {
  for (const double turns : {0.0, 1.0, -3.0, 1e6}) {
    const CompiledBackground sky = numbered(90 + 360 * turns);
    EXPECT_EQ(sky.radiance(normalize({-1, 0.1, -0.01}), 0), (Color{4, 1, 0})) << "what was at -z is at -x";
    EXPECT_EQ(sky.radiance(normalize({0.01, 0.1, -1}), 0), (Color{6, 1, 0})) << "and what was at +x at -z";
  }
}

TEST(EnvironmentBackground, IsAlignedWithTheCamerasUp) {
  const CompiledBackground sky = numbered(0, {0, 0, 5});
  EXPECT_EQ(sky.radiance(normalize({1, -0.01, 0.1}), 0), (Color{4, 1, 0})) << "+x where up is along z, -y to the right";
  EXPECT_EQ(sky.radiance(normalize({1, -0.01, 20}), 0), (Color{4, 0, 0}));
}

TEST(EnvironmentBackground, OfAGradientIsItsSecondColourAboveAndItsFirstBelow) {
  Texture gradient;
  gradient.pattern = GradientTexture{{Color{1, 0, 0}, Color{0, 0, 1}}};
  const CompiledBackground sky = around(gradient);
  for (const double spread : {0.0, 1e-9, 0.01}) {
    for (const double latitude : {-pi / 2, -1.0, 0.0, 0.5, pi / 2}) {
      const double t = 0.5 + latitude / pi;
      const Color seen = sky.radiance(towards(2, latitude), spread);
      EXPECT_NEAR(seen.b, t, spread / pi + 1e-15) << latitude;
      EXPECT_NEAR(seen.r, 1 - t, spread / pi + 1e-15) << latitude;
    }
  }
}

TEST(EnvironmentBackground, OfOneColorIsThatColorForEveryFootprint) {
  const Color color{0.25, 3, 7};
  const CompiledBackground sky = around(imaged(), 33, up, image_of(16, 8, [&](double, double) { return color; }));
  for (const double spread : {0.0, 1e-12, 0.01, 1.0, 100.0})
    for (const double latitude : {-pi / 2, -1.5, 0.0, 1.57, pi / 2}) {
      const Color seen = sky.radiance(towards(3.1, latitude), spread);
      EXPECT_NEAR(seen.r, color.r, 1e-6);
      EXPECT_NEAR(seen.g, color.g, 1e-5);
      EXPECT_NEAR(seen.b, color.b, 1e-5);
    }
}

/// A smooth image whose left edge goes on at its right: the seam must change no more than any other column.
TEST(EnvironmentBackground, HasNoLineAtItsSeam) {
  const auto image = image_of(64, 32, [](double x, double) {
    return Color{1, 1, 1} * (0.5 + 0.5 * std::sin((x + 0.5) / 64 * 2 * pi));
  });
  for (const auto filter : {Texture::Filter::bilinear, Texture::Filter::mipmap})
    for (const auto wrap : {Texture::Wrap::repeat, Texture::Wrap::clamp, Texture::Wrap::mirror}) {
      Texture texture = imaged(filter);
      texture.wrap = wrap;
      const CompiledBackground sky = around(texture, 0, up, image);
      for (const double spread : {0.001, 0.05, 0.3})
        for (int i = -50; i <= 50; ++i) {
          const double longitude = pi + 0.002 * i;
          EXPECT_NEAR(sky.radiance(towards(longitude, 0.3), spread).r, 0.5 + 0.5 * std::sin(longitude + pi), 0.015)
              << longitude << " " << spread;
        }
    }
}

/// The mean of what lies under a small circle around the pole is that of the top rows, whatever the columns hold.
TEST(EnvironmentBackground, MixesAllColumnsAtAPoleAndNoneOfTheRowsBelow) {
  const auto image = image_of(256, 128, [](double x, double y) {
    return y < 8 ? Color{is_even(x) ? 2.0 : 0.0, 0, 0} : Color{0, 1, 0};
  });
  const CompiledBackground sky = around(imaged(), 0, up, image);
  const Color pole = sky.radiance(up, 0.01);
  EXPECT_NEAR(pole.r, 1, 1e-6);
  EXPECT_EQ(pole.g, 0);
  EXPECT_NEAR(sky.radiance(towards(1, pi / 2 - 1e-7), 0.01).r, 1, 1e-6);
}

/// Columns of one texel, seen by a beam of three: their mean along the row, though the pyramid's levels are square.
TEST(EnvironmentBackground, CoversColumnsInProportionToTheLatitude) {
  const auto image = image_of(512, 256, [](double x, double y) {
    return Color{is_even(x) ? 2.0 : 0.0, y < 40 ? 1.0 : 0.0, 0};
  });
  const CompiledBackground sky = around(imaged(), 0, up, image);
  const double latitude = pi / 2 - 20.0 / 256 * pi;
  for (int i = 0; i < 50; ++i) {
    const Color seen = sky.radiance(towards(0.1 * i, latitude), pi / 256);
    EXPECT_NEAR(seen.r, 1, 0.3) << "alternating columns, about four of them: nearly their mean";
    EXPECT_EQ(seen.g, 1) << "twenty rows from the edge, seen by one";
  }
}

TEST(CubeBackground, OrientsEachFace) {
  // Each face 4 x 4: red is the face, green the column, blue the row.
  std::vector<Texture> textures(6, imaged(Texture::Filter::nearest));
  Images images;
  for (int face = 0; face < 6; ++face)
    images.push_back(image_of(4, 4, [&](double x, double y) { return Color{static_cast<double>(face), x, y}; }));
  Background background;
  background.cube.emplace();
  for (std::uint32_t face = 0; face < 6; ++face) background.cube->faces[face] = {face};
  struct Seen {
    Vec3 ahead, right, up;
  };
  // As a camera sees it whose up is y, and that leans back and forth from -z for the last two.
  const Seen y_up[] = {{{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},  {{-1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
                       {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},  {{0, -1, 0}, {1, 0, 0}, {0, 0, -1}},
                       {{0, 0, 1}, {-1, 0, 0}, {0, 1, 0}}, {{0, 0, -1}, {1, 0, 0}, {0, 1, 0}}};
  const Seen z_up[] = {{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},  {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                       {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},   {{0, -1, 0}, {-1, 0, 0}, {0, 0, 1}},
                       {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}}, {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}}};
  const CompiledBackground upright(background, {0.3, 2, 0.4}, textures, images);
  const CompiledBackground turned(background, {0, 0, 1}, textures, images);
  for (int face = 0; face < 6; ++face)
    for (const auto& [sky, seen] : {std::pair{&upright, y_up[face]}, {&turned, z_up[face]}}) {
      const auto expect_color = [&, sky = sky, seen = seen](double right, double above, double x, double y) {
        const Vec3 direction = normalize(seen.ahead + seen.right * right + seen.up * above);
        EXPECT_EQ(sky->radiance(direction, 0), (Color{static_cast<double>(face), x, y})) << face;
      };
      expect_color(0.9, 0.1, 3, 1);
      expect_color(-0.9, 0.9, 0, 0);
      expect_color(0.1, -0.99, 2, 3);
    }
}

TEST(CubeBackground, IsFilteredByTheFootprintOfTheRay) {
  const auto fine = image_of(64, 64, [](double x, double y) { return Color{is_even(x + y) ? 2.0 : 0.0, 0, 0}; });
  Background background;
  background.cube.emplace();
  const CompiledBackground sky(background, up, {imaged()}, {fine});
  EXPECT_NEAR(sky.radiance(normalize({0.3, 0.2, -1}), 4.0 / 64).r, 1, 1e-6) << "two texels wide: their mean";
  const double at_texel = (2 * 40.5 / 64) - 1;
  EXPECT_NEAR(std::abs(sky.radiance(normalize({at_texel, at_texel, -1}), 1e-6).r - 1), 1, 1e-3) << "one texel";
}

}  // namespace
}  // namespace tracer
