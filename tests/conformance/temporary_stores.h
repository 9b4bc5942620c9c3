#pragma once
/// Stores of one test in a temporary directory, without syncs of the database.

#include "server/storage/files/file_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"

struct TemporaryStores {
  TemporaryDirectory directory;
  TestStore store{directory.path(), {.synchronous = false}};
  storage::files::FileArtifactStore large_artifacts{directory.path()};
  storage::sqlite::SmallArtifactStore artifacts{store.sqlite(), large_artifacts};
};
