#pragma once
/// Objects in a bucket, under KIND/ab/abcdef...

#include <memory>
#include <string>

#include "server/storage/objects/object_store.h"
#include "server/storage/s3/s3_client.h"

namespace storage::s3 {

/// `kind`: such as "artifacts". `client` must outlive it.
std::unique_ptr<objects::ObjectStore> objects_in_bucket(S3Client& client, std::string kind);

}  // namespace storage::s3
