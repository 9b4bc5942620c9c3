// encode_picture FORMAT WIDTH HEIGHT: linear RGB floats on standard input (row 0 on top), the encoded file on standard
// output. Lets a test in another language, with readers of its own, look at what the encoders make.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tracer/encode.h"

int main(int count, char** arguments) {
  if (count != 4) return 2;
  const auto format = std::string_view(arguments[1]) == "png" ? tracer::Format::png : tracer::Format::exr;
  tracer::Image image{
      static_cast<std::uint32_t>(std::atoi(arguments[2])), static_cast<std::uint32_t>(std::atoi(arguments[3])), {}};
  image.rgb.resize(std::size_t{3} * image.width * image.height);
  if (std::fread(image.rgb.data(), sizeof(float), image.rgb.size(), stdin) != image.rgb.size()) return 3;
  const auto encoded = tracer::encode(image, format);
  if (!encoded) {
    std::fprintf(stderr, "%s\n", encoded.error().c_str());
    return 1;
  }
  return std::fwrite(encoded->data(), 1, encoded->size(), stdout) == encoded->size() ? 0 : 3;
}
