#include "tracer/cli/measure_files.h"

#include <array>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <utility>

#include "api/measurement_json.h"
#include "tracer/limits.h"
#include "tracer/plot.h"
#include "tracer/sha256.h"
#include "tracer/version.h"

namespace cli {
namespace {

constexpr std::size_t json_bytes_max = 64u << 20;
constexpr std::string_view signature = "whittle-reference-1";
constexpr std::size_t header_bytes_max = 256;

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::size_t array_bytes(const tracer::Reference& reference) {
  return 3 * sizeof(double) * std::size_t{reference.width} * reference.height;
}

std::string header_of(const tracer::Reference& reference, const std::string& key) {
  std::ostringstream header;
  header << signature << ' ' << key << ' ' << reference.width << ' ' << reference.height << ' '
         << reference.image_samples << ' ' << reference.images << ' ' << reference.complete << '\n';
  return std::move(header).str();
}

/// Returns nothing for a file that is invalid, truncated or of another key; the reference is then computed again.
std::optional<tracer::Reference> parse_reference(std::string_view bytes, const std::string& key) {
  const std::size_t end = bytes.substr(0, header_bytes_max).find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  std::istringstream header{std::string(bytes.substr(0, end))};
  std::string seen_signature, seen_key;
  tracer::Reference reference;
  header >> seen_signature >> seen_key >> reference.width >> reference.height >> reference.image_samples >>
      reference.images >> reference.complete;
  bytes.remove_prefix(end + 1);
  const std::size_t size = array_bytes(reference);
  if (!header || seen_signature != signature || seen_key != key || bytes.size() != 2 * size || size == 0)
    return std::nullopt;
  for (std::vector<double>* sums : {&reference.radiance_sum, &reference.squared_sum}) {
    sums->resize(size / sizeof(double));
    std::memcpy(sums->data(), bytes.data(), size);
    bytes.remove_prefix(size);
  }
  return reference;
}

}  // namespace

std::string fingerprint(std::string_view document, const tracer::Assets& assets, const MeasureOptions& options) {
  const auto [width, height] = options.size.value_or(std::pair(0u, 0u));
  std::ostringstream inputs;
  inputs << tracer::build() << ' ' << width << ' ' << height << ' ' << std::hexfloat << options.scale.value_or(0) << ' '
         << options.reference_samples << ' ' << options.threads << ' ' << tracer::sha256_hex(document);
  for (const std::vector<std::uint8_t>& bytes : assets.bytes)
    inputs << ' ' << tracer::sha256_hex({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return tracer::sha256_hex(inputs.str());
}

tracer::Result<SavedMeasurement, FileError> read_saved_measurement(const std::string& name, const std::string& key) {
  SavedMeasurement saved;
  const std::string json_path = name + ".json", reference_path = name + ".reference";
  std::error_code ignored;
  if (std::filesystem::exists(json_path, ignored)) {
    const auto text = read_text(json_path, json_bytes_max);
    if (!text) return text.error();
    auto measurement = api::read_measurement(*text);
    if (!measurement)
      return FileError{json_path + " exists and is not a measurement of this version; choose another -o"};
    if (measurement->info.key == key) {
      saved.points = std::move(measurement->points);
    } else {
      saved.has_other_key = true;
    }
  }
  if (std::filesystem::exists(reference_path, ignored)) {
    const auto bytes = read_text(reference_path, 6 * sizeof(double) * tracer::Limits().pixels + header_bytes_max);
    if (!bytes) return bytes.error();
    saved.reference = parse_reference(*bytes, key);
  }
  return saved;
}

FileResult write_reference(const std::string& name, const std::string& key, const tracer::Reference& reference) {
  std::string bytes = header_of(reference, key);
  for (const std::vector<double>* sums : {&reference.radiance_sum, &reference.squared_sum})
    bytes.append(reinterpret_cast<const char*>(sums->data()), sums->size() * sizeof(double));
  return write_file(name + ".reference", bytes_of(bytes));
}

FileResult write_points(const std::string& name, const std::string& key, const tracer::Measurement& measurement,
                        bool complete) {
  return write_file(name + ".json", bytes_of(api::write_measurement(measurement, {key, complete})));
}

FileResult write_results(const std::string& name, const tracer::Measurement& measurement) {
  const tracer::Plot plot = tracer::chart(measurement);
  const auto png = tracer::plot_png(plot);
  if (!png) return FileError{png.error()};
  const std::array<std::pair<const char*, std::string>, 3> contents{{{".csv", api::write_measurement_csv(measurement)},
                                                                     {".svg", tracer::plot_svg(plot)},
                                                                     {".png", std::string(png->begin(), png->end())}}};
  std::vector<PendingFile> files;
  for (const auto& [ending, bytes] : contents) {
    auto file = PendingFile::create(name + ending);
    if (!file) return file.error();
    if (auto written = file->write(bytes_of(bytes)); !written) return written;
    files.push_back(std::move(*file));
  }
  for (PendingFile& file : files)
    if (auto published = file.publish(); !published) return published;
  return std::monostate{};
}

}  // namespace cli
