#pragma once
/// A bucket of the S3 server of the test program, with an empty prefix of its own.

#include <string>

#include "server/storage/s3/bucket_objects.h"
#include "tests/support/s3_server.h"

class BucketUnderTest final : public storage::objects::ObjectStore {
 public:
  explicit BucketUnderTest(const std::string& kind) : objects_(storage::s3::objects_in_bucket(client_, kind)) {}
  void put(const std::string& sha256, std::uint64_t bytes, const queue::AssetStore::Read& read) override {
    objects_->put(sha256, bytes, read);
  }
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override { return objects_->open(sha256); }
  void remove(const std::string& sha256) override { objects_->remove(sha256); }
  std::vector<Object> list(const std::string& after) override { return objects_->list(after); }
  void remove_unfinished() override { objects_->remove_unfinished(); }
  [[nodiscard]] const std::string& prefix() const { return settings_.location.prefix; }

 private:
  storage::s3::S3Settings settings_ = S3Server::shared().settings();
  storage::s3::S3Client client_{settings_};
  std::unique_ptr<storage::objects::ObjectStore> objects_;
};
