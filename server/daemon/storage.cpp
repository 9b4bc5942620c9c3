#include "server/daemon/storage.h"

#include <filesystem>
#include <utility>

#include "server/worker/protocol/asset_directory.h"
#include "tracer/version.h"

namespace whittled {
namespace {

/// Null unless `wanted`.
template <class Store, class... Arguments>
std::unique_ptr<Store> make_if(bool wanted, Arguments&&... arguments) {
  return wanted ? std::make_unique<Store>(std::forward<Arguments>(arguments)...) : nullptr;
}

storage::postgres::PostgresSettings postgres_settings() {
  return {.node = queue::IdSource(queue::system_clock(), queue::system_random()).next(),
          .build = std::string(tracer::build())};
}

}  // namespace

Storage::Storage(const Config& config, const queue::Log& log, std::function<void(const std::string&)> on_disk_failure)
    : spool_directory(config.data + "/spool"),
      disk(config.data, {.reserve_bytes = config.disk_free_bytes}, log),
      disk_health(std::move(on_disk_failure)),
      sqlite(make_if<storage::sqlite::SqliteStores>(config.database.empty(), config.data,
                                                    storage::sqlite::SqliteSettings{.health = &disk_health})),
      lock(make_if<storage::files::DirectoryLock>(!sqlite, config.data)),
      postgres(make_if<storage::postgres::PostgresStores>(!sqlite, config.database, postgres_settings())),
      clock(sqlite ? queue::system_clock() : postgres->clock()),
      stores(sqlite ? sqlite->all() : postgres->all()),
      deliveries(sqlite ? sqlite->deliveries() : postgres->deliveries()),
      artifact_files(make_if<storage::files::FileArtifactStore>(config.artifacts.empty(), config.data, &disk_health)),
      upload_files(make_if<storage::files::FileAssetStore>(config.artifacts.empty(), uploads_directory(config), clock,
                                                           config.uploads_bytes, &disk_health)),
      small_artifacts(sqlite ? std::make_unique<storage::sqlite::SmallArtifactStore>(*sqlite, *artifact_files)
                             : nullptr),
      shared_files(artifact_files ? nullptr : std::make_unique<SharedFiles>(config, postgres->transactions(), clock)),
      asset_cache(shared_files ? std::make_unique<storage::objects::AssetCache>(
                                     uploads_directory(config), config.asset_cache_bytes, shared_files->assets())
                               : nullptr),
      artifacts(shared_files      ? shared_files->artifacts()
                : small_artifacts ? static_cast<queue::ArtifactStore&>(*small_artifacts)
                                  : *artifact_files),
      uploads(shared_files ? shared_files->assets() : *upload_files) {
  std::filesystem::create_directories(spool_directory);
  if (!config.assets.empty()) (void)worker::AssetDirectory(config.assets);  // reported at the start, not by each job
}

std::chrono::milliseconds Storage::maintain_artifacts(const queue::Log& log) {
  constexpr std::uint64_t bytes_per_ms = 10'000;  // slowly enough not to disturb others
  if (shared_files) return shared_files->collect(log);
  const auto scrubbed = artifact_files->scrub();
  if (!scrubbed) return std::chrono::hours(24);
  if (scrubbed->damaged) log(queue::LogLevel::error, "artifact_damaged", {{"sha256", scrubbed->artifact.sha256}});
  return std::chrono::milliseconds(20 + scrubbed->artifact.bytes / bytes_per_ms);
}

std::string uploads_directory(const Config& config) {
  return config.data + (config.artifacts.empty() ? "/uploads" : "/asset-cache");
}

void check_database(const Config& config) {
  if (!config.database.empty()) return storage::postgres::check_database(config.database);
  storage::sqlite::check_files(config.data);
}

}  // namespace whittled
