/// Data directories of older programs are brought up to date in place.

#include <gtest/gtest.h>

#include "server/storage/sqlite/database.h"
#include "server/storage/sqlite/schema.h"
#include "server/storage/sqlite/sqlite_job_store.h"
#include "tests/conformance/temporary_directory.h"

using namespace queue;

namespace {

/// A file as the first version left it: jobs that wait with two priorities, and one that succeeded.
void write_first_version(const std::string& path) {
  sqlite::Database database(path, sqlite::Database::Access::read_write);
  sqlite::prepare_file(database, path, 1);
  database.script(R"sql(
    INSERT INTO jobs (id, name, state, created_at, attempt, max_attempts, priority, cancel_requested, suspect, width,
                      height)
      VALUES ('job-1', 'low', 'queued', 1000, 0, 3, 40, 0, 0, 16, 12),
             ('job-2', 'high', 'queued', 2000, 1, 3, 90, 0, 0, 16, 12),
             ('job-3', 'done', 'succeeded', 3000, 1, 3, 50, 0, 0, 16, 12);
    INSERT INTO documents VALUES ('job-1', CAST('one' AS BLOB)), ('job-2', CAST('two' AS BLOB));
    INSERT INTO reports VALUES ('job-3', '{"rays": 1}');
    INSERT INTO artifacts VALUES ('job-3', 0, 'image.png', 'image/png', 'abc', 70);
    INSERT INTO labels VALUES ('shot', '7', 'job-3');
  )sql");
}

}  // namespace

TEST(Upgrade, KeepsEveryJobOfTheFirstVersionAndItsPlace) {
  const TemporaryDirectory directory;
  write_first_version(directory.path() + "/whittle.db");
  for (int opened = 0; opened < 2; ++opened) {  // the second time there is nothing to do
    SqliteJobStore store(directory.path());
    EXPECT_EQ(store.count(JobState::queued), 2);
    EXPECT_EQ(store.owner_usage("").queued_jobs, 2);
    EXPECT_EQ(store.owner_usage("").artifact_bytes, 70);
    EXPECT_EQ(store.depth().queued_by_priority, (std::map<int, std::int64_t>{{40, 1}, {90, 1}}));
    const Job done = store.find("job-3").value();
    EXPECT_EQ(done.report, "{\"rays\": 1}");
    EXPECT_EQ(done.artifacts.at(0).sha256, "abc");
    EXPECT_EQ(done.labels.at("shot"), "7");
    EXPECT_EQ(done.owner, "");
    EXPECT_EQ(done.kind, JobKind::render);
    EXPECT_EQ(done.accuracy, "");
    EXPECT_EQ(done.revision, 1);
    EXPECT_FALSE(done.expired);
  }
  SqliteJobStore store(directory.path());
  const Claim high = store.claim("boot", 5000, 9000, false).value();
  EXPECT_EQ(high.job.id, "job-2");
  EXPECT_EQ(high.document, "two");
  EXPECT_EQ(high.job.attempt, 2);
  EXPECT_EQ(store.claim("boot", 5000, 9000, false)->job.id, "job-1");
  store.remove("job-3");
  EXPECT_EQ(store.owner_usage("").artifact_bytes, 0);
}
