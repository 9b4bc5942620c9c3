#include "server/daemon/shared_files.h"

#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "server/queue/clock.h"
#include "server/storage/objects/object_store.h"
#include "server/storage/s3/bucket_objects.h"

namespace whittled {
namespace {

using storage::objects::ObjectIndex;

constexpr const char* bucket_scheme = "s3://";

storage::s3::S3Settings valid_settings(const Config& config) {
  auto settings = bucket_settings(config);
  if (!settings) throw std::runtime_error(settings.error().where + ": " + settings.error().sentence);
  return **std::move(settings);
}

}  // namespace

tracer::Result<std::optional<storage::s3::S3Settings>, ConfigError> bucket_settings(const Config& config) {
  if (!config.artifacts.starts_with(bucket_scheme)) return std::optional<storage::s3::S3Settings>();
  auto location = storage::s3::Location::parse(config.artifacts);
  if (!location) return ConfigError{"--artifacts", location.error()};
  const bool is_http = config.s3_endpoint.starts_with("http://") || config.s3_endpoint.starts_with("https://");
  const std::size_t host = config.s3_endpoint.find("://");
  if (!config.s3_endpoint.empty() && (!is_http || host + 3 == config.s3_endpoint.size() ||
                                      config.s3_endpoint.find_first_of("/?#@ ", host + 3) != std::string::npos)) {
    return ConfigError{"--s3-endpoint", "must be http://HOST:PORT or https://HOST, got \"" + config.s3_endpoint + '"'};
  }
  storage::s3::S3Settings settings;
  settings.endpoint = config.s3_endpoint;
  settings.region = config.s3_region;
  settings.path_style = config.s3_path_style == "on";
  settings.location = *std::move(location);
  settings.credentials_file = config.s3_credentials_file;
  return std::optional(std::move(settings));
}

void check_shared_files(const Config& config) {
  auto settings = bucket_settings(config);
  if (!settings) throw std::runtime_error(settings.error().sentence);
  if (*settings) {
    (*settings)->tries = 2;
    return storage::s3::S3Client(**std::move(settings)).check();
  }
  if (!std::filesystem::is_directory(config.artifacts))
    throw std::runtime_error(config.artifacts +
                             " is no directory; create it, since a mount that is missing would be one");
  if (::access(config.artifacts.c_str(), R_OK | W_OK | X_OK) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot write into " + config.artifacts);
}

SharedFiles::Medium::Medium(const Config& config) {
  if (config.artifacts.starts_with(bucket_scheme)) {
    client = std::make_unique<storage::s3::S3Client>(valid_settings(config));
    artifacts = storage::s3::objects_in_bucket(*client, "artifacts");
    assets = storage::s3::objects_in_bucket(*client, "assets");
  } else {
    artifacts = storage::objects::objects_in_directory(config.artifacts + "/artifacts");
    assets = storage::objects::objects_in_directory(config.artifacts + "/assets");
  }
}

SharedFiles::SharedFiles(const Config& config, storage::sql::Transactions& transactions, const queue::Clock& clock)
    : clock_(clock),
      medium_(config),
      artifact_index_(transactions, ObjectIndex::Kind::artifact),
      asset_index_(transactions, ObjectIndex::Kind::asset),
      artifacts_(*medium_.artifacts, artifact_index_, clock),
      assets_(*medium_.assets, asset_index_, clock, config.uploads_bytes) {}

std::chrono::milliseconds SharedFiles::collect(const queue::Log& log) {
  constexpr std::chrono::milliseconds step_pause(100), round_pause(std::chrono::hours(1));
  if (part_ < queue::AssetStore::parts) {
    const int removed = artifacts_.collect(part_++);
    if (removed > 0) log(queue::LogLevel::info, "artifacts_collected", {{"count", std::to_string(removed)}});
    return step_pause;
  }
  const std::int64_t now = clock_();
  adopted_ = adopt_objects(*medium_.artifacts, artifact_index_, adopted_, now);
  if (!adopted_.empty()) return step_pause;
  adopted_asset_ = adopt_objects(*medium_.assets, asset_index_, adopted_asset_, now);
  if (!adopted_asset_.empty()) return step_pause;
  medium_.artifacts->remove_unfinished();
  medium_.assets->remove_unfinished();
  part_ = 0;
  return round_pause;
}

}  // namespace whittled
