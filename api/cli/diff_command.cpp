#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "api/cli/files.h"
#include "api/cli/messages.h"
#include "api/cli/options.h"
#include "api/measurement_json.h"
#include "tracer/compare.h"
#include "tracer/encode.h"

namespace cli {
namespace {

constexpr std::size_t file_bytes_max = 1'000'000'000;  // 64 Mpx of uncompressed floats

tracer::Result<tracer::ImageFile, std::string> read(const std::string& path) {
  const std::string bytes = read_text(path, file_bytes_max);
  if (bytes.size() > file_bytes_max)
    return path + " is larger than file_bytes_max, " + std::to_string(file_bytes_max) + " bytes";
  auto file = tracer::read_image({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (!file) return path + " " + file.error();
  return std::move(*file);
}

void print_pixel(const tracer::PixelDifference& pixel) {
  std::printf("  %6u %6u %10.2f   %7.2f %7.2f %7.2f   %7.2f %7.2f %7.2f\n", pixel.x, pixel.y, pixel.difference,
              pixel.a[0], pixel.a[1], pixel.a[2], pixel.b[0], pixel.b[1], pixel.b[2]);
}

void print_metrics(const tracer::Comparison& found, const std::array<std::string, 2>& names,
                   const std::array<tracer::ImageFormat, 2>& kinds) {
  for (std::size_t i = 0; i < 2; ++i)
    std::printf("%c          %s (%s, %s)\n", i == 0 ? 'a' : 'b', names[i].c_str(), tracer::row(kinds[i]).name,
                tracer::is_linear(kinds[i]) ? "linear: exposure 0, clamped, encoded as sRGB" : "sRGB");
  std::printf("size       %u x %u\n", found.width, found.height);
  std::printf("rmse       %.4f levels (red %.4f, green %.4f, blue %.4f)\n", found.rmse, found.rmse_channel[0],
              found.rmse_channel[1], found.rmse_channel[2]);
  std::printf("bias       %+.4f levels (mean of b - a)\n", found.bias);
  std::printf("greatest   %.4f levels\n", found.greatest);
  if (std::isfinite(found.psnr_db)) {
    std::printf("psnr       %.2f dB\n", found.psnr_db);
  } else {
    std::puts("psnr       infinite: the images are equal");
  }
  if (found.ssim) {
    std::printf("ssim       %.6f of the luma\n", *found.ssim);
  } else {
    std::puts("ssim       none: the images are smaller than its window, 11 x 11 pixels");
  }
  std::printf("differing  %.4f %% of the pixels by more than one level\n", 100 * found.differing);
  if (found.worst.empty()) return;
  std::puts("worst           x      y difference   a: red   green    blue    b: red   green    blue");
  for (const tracer::PixelDifference& pixel : found.worst) print_pixel(pixel);
}

}  // namespace

ExitCode run(const DiffOptions& options) {
  auto a = read(options.images[0]);
  if (!a) return fail(a.error(), incomparable_images);
  auto b = read(options.images[1]);
  if (!b) return fail(b.error(), incomparable_images);
  const auto found = tracer::compare(a->image, b->image, options.worst);
  if (!found) return fail(found.error(), incomparable_images);
  const double white = options.heat_white.value_or(tracer::heat_scale(*found));
  if (options.heat_path) {
    const auto png = tracer::encode(tracer::heat_map(a->image, b->image, white), tracer::Format::png);
    if (!png) return fail(png.error());
    write_file(*options.heat_path, png->bytes);
  }
  const bool differ = options.tolerance && found->rmse > *options.tolerance;
  if (options.json) {
    const auto heat_white = options.heat_path ? std::optional(white) : std::nullopt;
    std::fputs(api::write_comparison(
                   *found, {{tracer::row(a->kind).name, tracer::row(b->kind).name}, options.tolerance, heat_white})
                   .c_str(),
               stdout);
  } else {
    print_metrics(*found, options.images, {a->kind, b->kind});
    if (options.heat_path) std::printf("heat map   %s: black 0, white %g levels\n", options.heat_path->c_str(), white);
    if (options.tolerance)
      std::printf("result     rmse %s the tolerance of %g levels\n", differ ? "above" : "within", *options.tolerance);
  }
  if (std::fflush(stdout) != 0) return environment_failure;
  return differ ? images_differ : success;
}

}  // namespace cli
