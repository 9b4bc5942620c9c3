#pragma once
/// Stores of objects that nodes share: a bucket of the S3 server of the test program, with an empty prefix of its own,
/// and a node.

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "server/storage/objects/object_store.h"
#include "server/storage/objects/shared_stores.h"
#include "server/storage/postgres/postgres_stores.h"
#include "server/storage/s3/bucket_objects.h"
#include "tests/support/postgres_server.h"
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

/// A node's SharedArtifactStore or SharedAssetStore, with its own connections to a database.
template <class Store>
struct SharedNode {
  /// `limit`: further arguments of Store.
  template <class... Limit>
  SharedNode(const std::string& database, std::unique_ptr<storage::objects::ObjectStore> all, const queue::Clock& clock,
             Limit... limit)
      : rows(database, {.connections = 4}), objects(std::move(all)), store(*objects, index, clock, limit...) {}

  using Kind = storage::objects::ObjectIndex::Kind;
  storage::postgres::PostgresStores rows;
  std::unique_ptr<storage::objects::ObjectStore> objects;
  storage::objects::ObjectIndex index{
      rows.transactions(), std::is_same_v<Store, storage::objects::SharedAssetStore> ? Kind::asset : Kind::artifact};
  Store store;
};

/// That of a node alone, on a new database.
template <class Store, class... Limit>
std::shared_ptr<Store> make_shared_store(std::unique_ptr<storage::objects::ObjectStore> objects,
                                         const queue::Clock& clock, Limit... limit) {
  const auto node =
      std::make_shared<SharedNode<Store>>(PostgresServer::shared().new_database(), std::move(objects), clock, limit...);
  return {node, &node->store};
}
