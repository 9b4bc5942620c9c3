#include "tracer/src/sampling/tiles.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {

std::optional<Image> Preview::snapshot(std::uint32_t side) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || tiles_ == nullptr) return std::nullopt;
  return tiles_->read(side);
}

PreviewTiles::PreviewTiles(Preview* preview, const Tiles& tiles, const PixelWindow& window, Mean mean)
    : preview_(preview), tiles_(tiles), width_(window.width()), height_(window.height()), mean_(std::move(mean)) {
  if (preview == nullptr) return;
  states_ = std::make_unique<std::atomic<std::uint8_t>[]>(tiles.count());
  closed_ = std::unique_lock(preview->mutex_);
  preview->tiles_ = this;
}

PreviewTiles::~PreviewTiles() {
  if (preview_ != nullptr) preview_->tiles_ = nullptr;
}

void PreviewTiles::lock(std::uint64_t tile) const {
  if (states_ == nullptr) return;
  while (states_[tile].exchange(locked, std::memory_order_acquire) == locked) std::this_thread::yield();
}

void PreviewTiles::unlock(std::uint64_t tile) const {
  if (states_ != nullptr) states_[tile].store(visible, std::memory_order_release);
}

/// Averages a grid of pixels of the visible tiles into each pixel of the small image.
Image PreviewTiles::read(std::uint32_t side) const {
  constexpr std::uint32_t samples_per_axis = 4;
  const std::uint32_t longest = std::max(width_, height_);
  const auto scaled = [&](std::uint32_t length) {
    if (longest <= side) return length;
    return std::max(1u, static_cast<std::uint32_t>(std::uint64_t{length} * side / longest));
  };
  Image image;
  image.width = scaled(width_);
  image.height = scaled(height_);
  const std::size_t pixels = std::size_t{image.width} * image.height;
  image.rgb.resize(3 * pixels);
  image.alpha.resize(pixels);
  const std::size_t wanted = std::size_t{samples_per_axis} * std::max(image.width, image.height);
  const std::size_t step = std::max<std::size_t>(1, (longest + wanted - 1) / wanted);
  const auto on_grid = [step](std::size_t at) { return (at + step - 1) / step * step; };
  for (std::uint64_t tile = 0; tile < tiles_.count(); ++tile) {
    if (states_[tile].load(std::memory_order_relaxed) == empty) continue;
    const PixelWindow window = tiles_.window(tile);
    const std::size_t first = tiles_.first_place(tile), left = first % width_, top = first / width_;
    lock(tile);
    for (std::size_t y = on_grid(top); y < top + window.height(); y += step) {
      for (std::size_t x = on_grid(left); x < left + window.width(); x += step) {
        const std::size_t at = y * image.height / height_ * image.width + x * image.width / width_;
        const Color mean = mean_(y * width_ + x);
        image.rgb[3 * at] += film_value(mean.r);
        image.rgb[3 * at + 1] += film_value(mean.g);
        image.rgb[3 * at + 2] += film_value(mean.b);
        image.alpha[at] += 1;
      }
    }
    unlock(tile);
  }
  for (std::size_t at = 0; at < pixels; ++at) {
    if (image.alpha[at] == 0) continue;
    for (std::size_t i = 3 * at; i < 3 * at + 3; ++i) image.rgb[i] = film_value(image.rgb[i] / image.alpha[at]);
    image.alpha[at] = 1;
  }
  return image;
}

}  // namespace tracer
