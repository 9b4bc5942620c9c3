#pragma once
/// Images and uploads of all nodes, in the bucket or directory that the option `artifacts` names.

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "server/daemon/config.h"
#include "server/queue/clock.h"
#include "server/queue/event_log.h"
#include "server/storage/objects/shared_stores.h"
#include "server/storage/s3/s3_client.h"
#include "server/storage/sql/sql_database.h"

namespace whittled {

/// The settings of the bucket; nothing where `artifacts` names a directory; or the rule that an option violates.
tracer::Result<std::optional<storage::s3::S3Settings>, ConfigError> bucket_settings(const Config& config);

/// Throws if the bucket or the directory cannot be used. Changes nothing, except that the directory is created.
void check_shared_files(const Config& config);

class SharedFiles {
 public:
  /// Throws StoreFailure. `transactions` must outlive it. `clock`: that of all nodes.
  SharedFiles(const Config& config, storage::sql::Transactions& transactions, const queue::Clock& clock);

  [[nodiscard]] queue::ArtifactStore& artifacts() { return artifacts_; }
  [[nodiscard]] queue::AssetStore& assets() { return assets_; }

  /// A URL that reads the artifact from the bucket for an hour; nothing where there is no bucket.
  [[nodiscard]] std::optional<std::string> url_of(const queue::Artifact& artifact) const {
    return medium_.artifacts->url_of(artifact.sha256, artifact.media_type);
  }

  /// One small step of the removal of artifacts that no job names and of traces of killed nodes; returns the pause
  /// before the next one. One thread.
  std::chrono::milliseconds collect(const queue::Log& log);

 private:
  /// The bytes.
  struct Medium {
    explicit Medium(const Config& config);
    std::unique_ptr<storage::s3::S3Client> client;  ///< null for a directory
    std::unique_ptr<storage::objects::ObjectStore> artifacts, assets;
  };

  const queue::Clock clock_;
  const Medium medium_;
  storage::objects::ObjectIndex artifact_index_, asset_index_;
  storage::objects::SharedArtifactStore artifacts_;
  storage::objects::SharedAssetStore assets_;
  int part_ = 0;                         ///< the next one of `collect`
  std::string adopted_, adopted_asset_;  ///< the last objects that were compared with the index
};

}  // namespace whittled
