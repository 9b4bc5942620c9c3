/// The contract of batches: jobs that are stored, cancelled and retried together.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

std::string id_of(int number) { return "0190a5b0-0000-7000-8000-00000000010" + std::to_string(number); }
const std::string batch_id = "0190a5b0-0000-7000-8000-0000000000b0";

/// A batch of `count` queued jobs.
InsertRequest batch_of(int count, std::optional<int> max_failed = {}) {
  InsertRequest admission;
  admission.batch = Batch{batch_id, "ann", "orbit", R"({"/a":[1]})", 1000, max_failed, count};
  for (int i = 0; i < count; ++i) {
    Job job;
    job.id = id_of(i);
    job.owner = "ann";
    job.batch = batch_id;
    job.batch_index = i;
    job.variation = R"({"n":)" + std::to_string(i) + "}";
    admission.jobs.push_back({job, "document " + std::to_string(i)});
  }
  return admission;
}

std::map<JobState, std::int64_t> counts(StoreCalls& store) { return store.find_batch(batch_id)->jobs; }

}  // namespace

TEST_P(JobStoreConformance, FindsABatchAndItsJobsInOrder) {
  submit();
  store().insert(batch_of(3, 7), now);
  reopen();
  const BatchState state = store().find_batch(batch_id).value();
  EXPECT_EQ(state.batch.owner, "ann");
  EXPECT_EQ(state.batch.name, "orbit");
  EXPECT_EQ(state.batch.created_at, 1000);
  EXPECT_EQ(state.batch.max_failed, 7);
  EXPECT_EQ(state.batch.size, 3);
  EXPECT_EQ(state.batch.sweep, R"({"/a":[1]})");
  EXPECT_EQ(state.jobs, (std::map<JobState, std::int64_t>{{JobState::queued, 3}}));
  JobFilter of_batch;
  of_batch.batch = batch_id;
  EXPECT_EQ(list(of_batch, 2), (std::vector<std::string>{id_of(2), id_of(1), id_of(0)}));
  of_batch.state = JobState::running;
  EXPECT_TRUE(list(of_batch).empty());
  EXPECT_EQ(find(id_of(2)).batch, batch_id);
  EXPECT_EQ(find(id_of(2)).batch_index, 2);
  EXPECT_EQ(find(id_of(2)).variation, R"({"n":2})");
  EXPECT_EQ(store().document(id_of(1)), "document 1");
  EXPECT_FALSE(store().find_batch(id_of(0)));
}

TEST_P(JobStoreConformance, ListsBatchesNewestFirstInPages) {
  EXPECT_TRUE(store().list_batches("", 2).items.empty());
  std::vector<std::string> ids;
  for (const char last : {'1', '2', '3'}) {
    InsertRequest request = batch_of(1);
    ids.push_back(request.batch->id = batch_id.substr(0, 35) + last);
    request.jobs[0].job.id = request.jobs[0].job.id.substr(0, 34) + "f" + last;
    request.jobs[0].job.batch = request.batch->id;
    store().insert(request, now);
  }
  const BatchPage first = store().list_batches("", 2);
  ASSERT_EQ(first.items.size(), 2u);
  EXPECT_EQ(first.items[0].batch.id, ids[2]);
  EXPECT_EQ(first.items[1].batch.id, ids[1]);
  EXPECT_EQ(first.items[1].jobs, (std::map<JobState, std::int64_t>{{JobState::queued, 1}}));
  const BatchPage second = store().list_batches(first.next_cursor, 2);
  ASSERT_EQ(second.items.size(), 1u);
  EXPECT_EQ(second.items[0].batch.id, ids[0]);
  EXPECT_EQ(second.next_cursor, "");
}

TEST_P(JobStoreConformance, RemovesTheEndedJobsOfABatchAndTheBatchWithTheLast) {
  store().insert(batch_of(4), now);
  const std::string sha256(64, 'a');
  for (int i = 0; i < 3; ++i) succeed_next({{"image.png", "image/png", sha256, 5}});
  const std::vector<JobSummary> removed = store().remove_ended(batch_id, 2).jobs;
  ASSERT_EQ(removed.size(), 2u);
  EXPECT_EQ((std::pair{removed[0].id, removed[1].id}), (std::pair{id_of(0), id_of(1)}));
  EXPECT_EQ(removed[0].batch, batch_id);
  const std::string other = submit();
  const BatchRemoval last = store().remove_ended(batch_id, 2);
  ASSERT_EQ(last.jobs.size(), 1u);
  EXPECT_EQ(last.jobs[0].id, id_of(2));
  EXPECT_EQ(last.artifacts.size(), 1u);
  EXPECT_TRUE(store().remove_ended(batch_id, 2).jobs.empty()) << "one waits";
  EXPECT_EQ(counts(store()), (std::map<JobState, std::int64_t>{{JobState::queued, 1}}));
  store().cancel(id_of(3), now);
  store().remove_ended(batch_id, 2);
  EXPECT_FALSE(store().find_batch(batch_id));
  EXPECT_TRUE(store().find(other));
}

TEST_P(JobStoreConformance, KeepsTheSceneOfABatchAsLongAsOneOfItsDocuments) {
  const std::string upload(64, 'a');
  InsertRequest request = batch_of(3);
  request.scene = CommonScene{"scene", {upload}};
  request.jobs[0].job.expires_at = now + 5;
  store().insert(request, now);
  submit([](Job& job) { job.owner = "ann"; });
  reopen();
  const Claim first = claim();
  EXPECT_EQ(first.document, "document 0");
  EXPECT_EQ(first.scene, "scene");
  EXPECT_EQ(store().scene(id_of(2)), "scene");
  store().succeed(first.job.id, first.fence, now, "{}", {});
  EXPECT_EQ(store().run_maintenance(now + 5, 1000, 10).expired, 1);
  EXPECT_TRUE(store().is_asset_referenced(upload));
  EXPECT_EQ(claim().scene, "scene") << "of another job";
  store().remove(id_of(2));
  EXPECT_TRUE(store().is_asset_referenced(upload));
  store().succeed(id_of(1), 1, now, "{}", {});
  store().remove(id_of(1));
  EXPECT_FALSE(store().is_asset_referenced(upload));
  EXPECT_TRUE(store().find(id_of(0))) << "expired, without a document";
  const Claim alone = claim();
  EXPECT_EQ(alone.scene, std::nullopt) << "submitted alone";
  EXPECT_EQ(store().scene(alone.job.id), std::nullopt);
}

TEST_P(JobStoreConformance, InsertsNothingOfABatchUnderAUsedKey) {
  InsertRequest admission = batch_of(2);
  const KeptReply reply{{"ann", "POST /v1/batches", "k"}, "hash", {202, "", "{}"}, now + 10};
  store().insert({{}, {}, reply}, now);
  admission.reply = reply;
  EXPECT_TRUE(store().insert(admission, now));
  EXPECT_FALSE(store().find_batch(batch_id));
  EXPECT_FALSE(store().find(id_of(0)));
}

TEST_P(JobStoreConformance, CancellingABatchCancelsItsJobsThatHaveNotEnded) {
  const std::string other = submit([](Job& job) { job.owner = "ann", job.priority = 0; });
  store().insert(batch_of(3), now);
  succeed_next();
  const Claim running = claim();
  const BatchCancel changed = store().cancel_batch(batch_id, now + 5);
  EXPECT_EQ(changed.cancelled, std::vector<std::string>{id_of(2)});
  EXPECT_EQ(changed.cancelling, std::vector<std::string>{running.job.id});
  EXPECT_EQ(find(id_of(2)).ended_at, now + 5);
  EXPECT_EQ(find(other).state, JobState::queued);
  EXPECT_EQ(counts(store()), (std::map<JobState, std::int64_t>{
                                 {JobState::succeeded, 1}, {JobState::running, 1}, {JobState::cancelled, 1}}));
  EXPECT_TRUE(store().cancel_batch("nobody", now).cancelled.empty());
}

TEST_P(JobStoreConformance, RetryingABatchQueuesItsFailedAndCancelledJobs) {
  store().insert(batch_of(3), now);
  succeed_next();
  const std::string failed = fail_next().id;
  store().cancel_batch(batch_id, now);
  const BatchRetry retried = store().retry_batch(batch_id, now);
  ASSERT_EQ(retried.jobs.size(), 2u);
  EXPECT_NE(retried.jobs[0], retried.jobs[1]);
  EXPECT_FALSE(retried.suspects);
  EXPECT_EQ(counts(store()), (std::map<JobState, std::int64_t>{{JobState::queued, 2}, {JobState::succeeded, 1}}));
  EXPECT_EQ(find(failed).problem, std::nullopt);
  EXPECT_TRUE(store().retry_batch(batch_id, now).jobs.empty());
  const Claim suspect = claim();
  store().release(suspect.job.id, suspect.fence, now, {.counts = true, .suspect = true});
  store().cancel_batch(batch_id, now);
  EXPECT_TRUE(store().retry_batch(batch_id, now).suspects);
}

TEST_P(JobStoreConformance, ListsFailingBatches) {
  store().insert(batch_of(3, 1), now);
  EXPECT_TRUE(store().failing_batches().empty());
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(store().failing_batches().empty());
    fail_next();
  }
  EXPECT_EQ(store().failing_batches(), std::vector<std::string>{batch_id});
  store().cancel_batch(batch_id, now);
  EXPECT_TRUE(store().failing_batches().empty()) << "nothing is left to stop";
}

TEST_P(JobStoreConformance, DeletesABatchWithItsLastJob) {
  store().insert(batch_of(2), now);
  store().remove(id_of(0));
  EXPECT_EQ(counts(store()), (std::map<JobState, std::int64_t>{{JobState::queued, 1}}));
  EXPECT_EQ(store().find_batch(batch_id)->batch.size, 2);
  store().remove(id_of(1));
  EXPECT_FALSE(store().find_batch(batch_id));
}
