#pragma once
/// Objects in a bucket, under KIND/ab/abcdef...

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/storage/objects/object_store.h"
#include "server/storage/s3/s3_client.h"

namespace storage::s3 {

class BucketObjects final : public objects::ObjectStore {
 public:
  /// `kind`: such as "artifacts". `client` must outlive it.
  BucketObjects(S3Client& client, std::string kind) : client_(client), kind_(std::move(kind)) {}

  void put(const std::string& sha256, std::uint64_t bytes, const queue::AssetStore::Read& read) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override;
  void remove(const std::string& sha256) override;
  std::vector<Object> list(const std::string& after) override;
  void remove_unfinished() override;

  /// A URL that is valid for an hour; see S3Client::presigned_url.
  [[nodiscard]] std::string presigned_url(const std::string& sha256, Parameters parameters) const;

 private:
  [[nodiscard]] std::string key_of(const std::string& sha256) const;

  S3Client& client_;
  const std::string kind_;
};

}  // namespace storage::s3
