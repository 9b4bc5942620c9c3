// encode_image FORMAT WIDTH HEIGHT [alpha] [layers] [palette] [half] [quality=N] [error]: linear RGB floats on standard
// input (row 0 on top), after them with `alpha` its floats and with `layers` the depths (floats), object ids (32 bits)
// and errors (floats); the encoded file on standard output, with `palette` in 16 colours and with `half` in 16-bit
// floats, or with `error` its encoding error. Lets a test in another language, with readers of its own, look at what
// the encoders make.
#include <cstdint>
#include <cstdio>
#include <string_view>

#include "tracer/encode.h"

namespace {

template <class T>
bool take(std::vector<T>& values, std::size_t count) {
  values.resize(count);
  return std::fread(values.data(), sizeof(T), count, stdin) == count;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) return 2;
  tracer::Format format{};
  for (const tracer::Format known : tracer::all_formats)
    if (tracer::name(known) == arguments[1]) format = known;
  tracer::Image image;
  image.width = static_cast<std::uint32_t>(std::atoi(arguments[2]));
  image.height = static_cast<std::uint32_t>(std::atoi(arguments[3]));
  const std::size_t pixels = std::size_t{image.width} * image.height;
  if (!take(image.rgb, 3 * pixels)) return 3;
  tracer::Output output;
  bool error_only = false;
  for (int i = 4; i < count; ++i) {
    const std::string_view option = arguments[i];
    if (option == "alpha" && !take(image.alpha, pixels)) return 3;
    if (option == "layers" && (!take(image.layers.depth, pixels) || !take(image.layers.object_id, pixels) ||
                               !take(image.layers.error, pixels)))
      return 3;
    if (option == "palette") output.palette = 16;
    if (option == "half") output.half = true;
    if (option.starts_with("quality=")) output.quality = static_cast<std::uint32_t>(std::atoi(arguments[i] + 8));
    if (option == "error") error_only = true;
  }
  const auto encoded = tracer::encode(image, format, output);
  if (!encoded) {
    std::fprintf(stderr, "%s\n", encoded.error().c_str());
    return 1;
  }
  if (error_only) return std::printf("%.17g\n", encoded->error.image) > 0 ? 0 : 3;
  const std::vector<std::uint8_t>& bytes = encoded->bytes;
  return std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() ? 0 : 3;
}
