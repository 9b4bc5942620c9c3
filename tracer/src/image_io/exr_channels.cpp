#include "tracer/src/image_io/exr_channels.h"

#include <cstring>
#include <initializer_list>
#include <type_traits>
#include <utility>

namespace tracer {
namespace {

/// A layer of `width` 32-bit words per pixel.
struct Source {
  const void* words = nullptr;
  std::size_t width = 1;
};

class Collector {
 public:
  template <class T>
  void take(const std::vector<T>& layer, std::initializer_list<const char*> names) {
    static_assert(sizeof(T) == 4);
    if (layer.empty()) return;
    sources_.push_back({layer.data(), names.size()});
    for (const char* name : names) {
      channels_.names.emplace_back(name);
      channels_.is_integer.push_back(std::is_integral_v<T>);
    }
  }

  ExrChannels interleaved(std::size_t pixels) {
    channels_.words.resize(pixels * channels_.names.size());
    std::uint32_t* to = channels_.words.data();
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      for (const Source& source : sources_) {
        std::memcpy(to, static_cast<const std::uint32_t*>(source.words) + pixel * source.width, 4 * source.width);
        to += source.width;
      }
    }
    return std::move(channels_);
  }

 private:
  ExrChannels channels_;
  std::vector<Source> sources_;
};

}  // namespace

ExrChannels exr_channels(const Image& image) {
  Collector collector;
  collector.take(image.rgb, {"R", "G", "B"});
  collector.take(image.alpha, {"A"});
  collector.take(image.layers.depth, {"Z"});
  collector.take(image.layers.normal, {"normal.X", "normal.Y", "normal.Z"});
  collector.take(image.layers.albedo, {"albedo.R", "albedo.G", "albedo.B"});
  collector.take(image.layers.object_id, {"object_id"});
  collector.take(image.layers.samples, {"samples"});
  collector.take(image.layers.error, {"error"});
  return collector.interleaved(std::size_t{image.width} * image.height);
}

}  // namespace tracer
