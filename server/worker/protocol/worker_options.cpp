#include "server/worker/protocol/worker_options.h"

#include <charconv>

namespace worker {
namespace {

constexpr int slots_max = 4096, threads_max = 1024;

template <class Number>
bool read(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

bool read(std::string_view name, std::string_view text, Options& options) {
  if (name == "--slots") return read(text, options.slots) && options.slots >= 1 && options.slots <= slots_max;
  if (name == "--job-memory-bytes") return read(text, options.job_memory_bytes);
  if (name == "--threads") return read(text, options.threads) && options.threads >= 0 && options.threads <= threads_max;
  if (name == "--scene-cache") return read(text, options.scene_cache_bytes);
  if (name == "--cache-idle-ms") return read(text, options.cache_idle_ms);
  if (name == "--objects") return read(text, options.files.objects);
  if (name == "--triangles") return read(text, options.files.triangles);
  if (name == "--uploads") {
    options.files.uploads = text;
    return true;
  }
  if (name != "--assets") return false;
  options.files.directory = text;
  return true;
}

}  // namespace

std::vector<std::string> arguments_of(const Options& options) {
  const auto text = [](auto number) { return std::to_string(number); };
  const FileSettings& files = options.files;
  return {"--slots",
          text(options.slots),
          "--threads",
          text(options.threads),
          "--job-memory-bytes",
          text(options.job_memory_bytes),
          "--scene-cache",
          text(options.scene_cache_bytes),
          "--cache-idle-ms",
          text(options.cache_idle_ms),
          "--assets",
          files.directory,
          "--uploads",
          files.uploads,
          "--objects",
          text(files.objects),
          "--triangles",
          text(files.triangles)};
}

std::optional<Options> parse_options(const std::vector<std::string_view>& arguments) {
  if (arguments.empty() || arguments.size() % 2 != 0) return std::nullopt;
  Options options;
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    if (!read(arguments[i], arguments[i + 1], options)) return std::nullopt;
  }
  return options;
}

}  // namespace worker
