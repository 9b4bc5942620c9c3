// Textures of every kind, to the horizon, and reliefs.
#include "tests/statistics/scene_corpus.h"
#include "tracer/encode.h"

namespace statistics {
namespace {

using namespace tracer;

Texture noise(double scale, std::uint32_t octaves) {
  Texture texture;
  texture.pattern = NoiseTexture{{Color{0, 0.05, 0.1}, Color{1, 0.9, 0.7}}, octaves};
  texture.scale = {scale, scale};
  return texture;
}

Case floor_of(std::string name, std::string exercises, const Texture& texture) {
  Case c = lit_floor_case(std::move(name), std::move(exercises));
  c.scene.objects[0].material = scenes::add(c.scene, textured(c.scene, texture));
  return c;
}

Case checker_to_horizon(std::string name, std::string exercises, Texture::Filter filter) {
  Texture squares = checker(1.5);
  squares.filter = filter;
  return floor_of(std::move(name), std::move(exercises), squares);
}

Case fine_checker() {
  Case c =
      floor_of("fine_checker", "squares about a pixel wide: every pixel an edge, none like its neighbour", checker(1));
  c.scene.camera = {{0, 10, 0}, {0, 0, 0.1}, {0, 0, -1}, 40};
  c.scene.textures[0].scale = {5.3, 4.7};
  c.scene.textures[0].filter = Texture::Filter::nearest;
  return c;
}

Case gradients() {
  Case c = lit_floor_case("gradients", "gradients wrapped in all three ways, on spheres and cones");
  for (int i = 0; i < 3; ++i) {
    Texture bands;
    bands.pattern = GradientTexture{{Color{0.9, 0.1, 0.1}, Color{0.1, 0.2, 0.9}}};
    bands.scale = {1, 6};
    bands.wrap = static_cast<Texture::Wrap>(i);
    if (i == 1) bands.offset = {0, -2};
    scenes::add(c.scene, Sphere{{-1.7 + 1.7 * i, 0.75, 0}, 0.7}, textured(c.scene, bands));
  }
  return c;
}

/// An image of 64 x 64 texels that has detail at every scale, as the bytes of a PNG.
std::vector<std::uint8_t> image_bytes() {
  Image image{64, 64, std::vector<float>(64 * 64 * 3)};
  for (std::uint32_t y = 0; y < 64; ++y)
    for (std::uint32_t x = 0; x < 64; ++x) {
      float* rgb = image.rgb.data() + 3 * (64 * y + x);
      rgb[0] = (x & y) % 2 == 0 ? 0.8F : 0.1F;
      rgb[1] = static_cast<float>((x ^ y) % 16) / 16;
      rgb[2] = static_cast<float>(y) / 64;
    }
  const auto png = encode(image, Format::png);
  return png->bytes;
}

Texture image(Case& c, Texture::Filter filter) {
  if (c.scene.assets.empty()) {
    c.scene.assets = {{"image.png", "/textures/image/file"}};
    c.assets.bytes = {image_bytes()};
  }
  Texture texture;
  texture.pattern = ImageTexture{{0}, {}};
  texture.filter = filter;
  return texture;
}

Case images() {
  Case c = lit_floor_case("images", "an image file through each filter, near and to the horizon");
  const Texture::Filter filters[] = {Texture::Filter::nearest, Texture::Filter::bilinear, Texture::Filter::mipmap};
  for (int i = 0; i < 3; ++i) {
    scenes::add(c.scene, Box{{-2.2 + 1.6 * i, 0, 0}, {-1.0 + 1.6 * i, 1.2, 1}},
                textured(c.scene, image(c, filters[i])));
    scenes::add(c.scene, Sphere{{-1.6 + 1.6 * i, 1.6, 0.3}, 0.4}, c.scene.objects.back().material);
  }
  Texture far = image(c, Texture::Filter::mipmap);
  far.scale = {0.3, 0.3};
  c.scene.objects[0].material = scenes::add(c.scene, textured(c.scene, far));
  return c;
}

Case bumps() {
  Case c = lit_floor_case("bumps", "reliefs of noise, with highlights on every bump, and of checkers");
  Material floor = phong({0.6, 0.6, 0.6}, 0.6, 50);
  c.scene.textures.push_back(noise(2.5, 3));
  floor.bump = Bump{{0}, 0.15};
  c.scene.objects[0].material = scenes::add(c.scene, floor);
  c.scene.textures.push_back(checker(12));
  Material ball = phong({0.8, 0.4, 0.2}, 0.5, 30);
  ball.bump = Bump{{1}, -0.01};
  scenes::add(c.scene, Sphere{{0, 0.8, 0}, 0.8}, ball);
  return c;
}

Case normal_map() {
  Case c = lit_floor_case("normal_map", "normals of an image file, under a mirror's coat");
  c.scene.textures.push_back(image(c, Texture::Filter::mipmap));
  Material wall = phong({0.5, 0.6, 0.7}, 0.4, 40);
  wall.normal_map = TextureId{0};
  wall.reflection = 0.3;
  scenes::add(c.scene, Box{{-1.5, 0, -0.5}, {1.5, 1.6, 0.5}}, wall);
  c.scene.objects.back().transform = turned(20, {});
  return c;
}

Case cloth() {
  Case c = lit_floor_case("cloth", "fine checkers on curved things: their frequency grows towards the edge");
  Texture weave = checker(1);
  weave.scale = {60, 30};
  scenes::add(c.scene, Sphere{{-1, 0.9, 0}, 0.9}, textured(c.scene, weave));
  weave.filter = Texture::Filter::nearest;
  scenes::add(c.scene, Cylinder{{1.2, 0, 0}, {1.2, 1.7, 0}, 0.7, true, {}}, textured(c.scene, weave));
  return c;
}

}  // namespace

std::vector<Case> texture_cases() {
  return {
      checker_to_horizon("checker_filtered", "squares to the horizon, filtered", Texture::Filter::mipmap),
      checker_to_horizon("checker_nearest", "squares to the horizon, looked up at points", Texture::Filter::nearest),
      fine_checker(),
      floor_of("noise_to_horizon", "six octaves of noise to the horizon", noise(0.7, 6)),
      gradients(),
      images(),
      bumps(),
      normal_map(),
      cloth()};
}

}  // namespace statistics
