/// The contract of rows: every field of a job is stored and read.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

TEST_P(JobStoreConformance, KeepsEveryFieldOfAJob) {
  const Job plain = new_job();
  Job job = new_job();
  job.created_at = 1'700'000'000'123;
  static_cast<api::JobRequest&>(job) = {.name = "two \"spheres\", \xC3\xA9t\xC3\xA9",
                                        .labels = {{"batch", "orbit"}, {"frame", "17"}},
                                        .priority = 91,
                                        .max_attempts = 7,
                                        .run_after = job.created_at + 10,
                                        .deadline = job.created_at + 20,
                                        .expires_in_s = 30,
                                        .webhook = api::Webhook{"https://example.org/hook", {"failed", "succeeded"}}};
  job.not_before = job.run_after;
  std::tie(job.owner, job.weight, job.variation, job.formats) = std::tuple("ann", 7, "{}", "exr 16.png");
  std::tie(job.kind, job.width, job.height, job.work, job.large) = std::tuple(JobKind::measure, 1920, 1080, 123, true);
  std::tie(job.accuracy, job.content_key) = std::tuple(R"({"target_error":2.0})", "key");
  job.assets = {std::string(64, 'b'), std::string(64, 'a')};
  for (const Job& each : {plain, job}) store().submit(each, "{}");
  reopen();
  EXPECT_EQ(find(plain.id), plain);
  EXPECT_EQ(find(job.id), job);
}

TEST_P(JobStoreConformance, NamesTheUploadsOfAJobUntilItIsRemoved) {
  const std::string tile(64, 'a'), vase(64, 'b');
  const std::string first = submit([&](Job& job) { job.assets = {vase, tile}; });
  const std::string second = submit([&](Job& job) { job.assets = {tile}; });
  EXPECT_EQ(find(first).assets, (std::vector<std::string>{vase, tile}));
  reopen();
  EXPECT_TRUE(store().is_asset_referenced(tile));
  EXPECT_TRUE(store().is_asset_referenced(vase));
  EXPECT_FALSE(store().is_asset_referenced(std::string(64, 'c')));
  store().remove(first);
  EXPECT_TRUE(store().is_asset_referenced(tile)) << "by the other";
  EXPECT_FALSE(store().is_asset_referenced(vase));
  store().remove(second);
  EXPECT_FALSE(store().is_asset_referenced(tile));
}

TEST_P(JobStoreConformance, KeepsTheDocumentVerbatim) {
  std::string all_bytes;
  for (int i = 0; i < 3 * 256; ++i) all_bytes.push_back(static_cast<char>(i));
  for (const std::string& document : {all_bytes, std::string(20u << 20, 'x')}) {
    const std::string id = submit({}, document);
    reopen();
    EXPECT_TRUE(store().document(id) == document) << document.size() << " bytes";
    EXPECT_TRUE(claim().document == document) << document.size() << " bytes";
  }
}

TEST_P(JobStoreConformance, FindsNothingUnderAnUnknownId) {
  submit();
  EXPECT_FALSE(store().find("no such job"));
  EXPECT_FALSE(store().document("no such job"));
  EXPECT_EQ(store().cancel("no such job", now), CancelOutcome::unknown);
  EXPECT_EQ(store().remove("no such job").outcome, RemoveOutcome::unknown);
  EXPECT_FALSE(store().succeed("no such job", 1, now, "{}", {}));
}

TEST_P(JobStoreConformance, KeepsTheReportAndTheArtifactsInOrder) {
  const Placed placed = place(JobState::running);
  Job job = find(placed.id);
  const std::string png(64, 'b'), exr(64, 'a');
  job.state = JobState::succeeded;
  job.ended_at = now + 5;
  job.report = R"({"rays":1})";
  job.artifacts = {{"image.png", "image/png", png, 12}, {"image.exr", "image/x-exr", exr, 1ull << 40}};
  ++job.revision;
  EXPECT_TRUE(store().succeed(placed.id, placed.fence, now + 5, job.report, job.artifacts));
  reopen();
  EXPECT_EQ(find(placed.id), job);
  EXPECT_TRUE(store().is_artifact_referenced(png));
  EXPECT_FALSE(store().is_artifact_referenced(std::string(64, 'c')));
}

TEST_P(JobStoreConformance, KeepsTheProblemWithAllItsErrorsInOrder) {
  const Placed placed = place(JobState::running);
  Job job = find(placed.id);
  job.state = JobState::failed;
  job.ended_at = now;
  job.problem = Problem{"bad_scene",
                        "2 things are wrong.",
                        {{"/objects/1/radius", "out_of_range", "must be > 0, got -1"},
                         {"/camera", "degenerate", "position and look_at are the same point"}}};
  ++job.revision;
  EXPECT_TRUE(store().fail(placed.id, placed.fence, now, *job.problem));
  reopen();
  EXPECT_EQ(find(placed.id), job);
}

TEST_P(JobStoreConformance, CountsTheJobsOfEachState) {
  for (const JobState state : {JobState::succeeded, JobState::failed, JobState::running}) place(state);
  place(JobState::cancelled);
  submit();
  store().remove(submit());
  reopen();
  for (const JobState state :
       {JobState::queued, JobState::running, JobState::succeeded, JobState::failed, JobState::cancelled}) {
    EXPECT_EQ(store().count(state), 1) << name_of(state);
  }
}

TEST_P(JobStoreConformance, ProbesWithASmallWrite) { EXPECT_NO_THROW(store().probe()); }

TEST_P(JobStoreConformance, RemovesEverythingOfAJobThatDoesNotRun) {
  for (const JobState state : {JobState::succeeded, JobState::failed, JobState::cancelled, JobState::queued}) {
    const Placed job = place(state);
    EXPECT_EQ(store().remove(job.id).outcome, RemoveOutcome::removed) << name_of(state);
    EXPECT_FALSE(store().find(job.id)) << name_of(state);
    EXPECT_FALSE(store().document(job.id)) << name_of(state);
    EXPECT_EQ(store().remove(job.id).outcome, RemoveOutcome::unknown) << name_of(state);
  }
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
}

TEST_P(JobStoreConformance, RemovesAJobOnceItHasEndedAndReturnsItsArtifacts) {
  const Placed job = place(JobState::running);
  const std::string sha256(64, 'a');
  EXPECT_EQ(store().remove(job.id).outcome, RemoveOutcome::running);
  EXPECT_TRUE(store().succeed(job.id, job.fence, now, "{}", {{"image.png", "image/png", sha256, 1}}));
  const Removal removal = store().remove(job.id);
  ASSERT_EQ(removal.artifacts.size(), 1u);
  EXPECT_EQ(removal.artifacts[0].sha256, sha256);
  EXPECT_FALSE(store().is_artifact_referenced(sha256));
}

TEST_P(JobStoreConformance, DeletesEndedJobsThatAreNotKept) {
  const auto draft = [](Job& job) { job.keep = false; };
  const std::string kept = submit();
  const std::string ends = submit(draft), waits = submit(draft);
  EXPECT_EQ(list(), std::vector{kept});
  EXPECT_FALSE(find(ends).keep);
  store().cancel(kept, now);
  store().cancel(ends, now);
  const Retention retention{.unkept_ms = 10};
  EXPECT_EQ(store().run_maintenance(now + 9, retention, 10).deleted, 0);
  EXPECT_EQ(store().run_maintenance(now + 10, retention, 10).deleted, 1);
  EXPECT_FALSE(store().find(ends));
  EXPECT_EQ(find(waits).state, JobState::queued);
  EXPECT_EQ(find(kept).state, JobState::cancelled);
  if (is_shared()) return;
  EXPECT_EQ(store().recover("another boot", now), 0);
  EXPECT_EQ(find(waits).state, JobState::cancelled) << "its client is gone";
}

TEST_P(JobStoreConformance, AddsAnArtifactToAStoppedJobOfTheSameFence) {
  const Artifact preview{"preview.png", "image/png", std::string(64, 'a'), 7};
  const std::string id = submit();
  const Claim claimed = claim();
  EXPECT_FALSE(store().add_artifact(id, claimed.fence, preview)) << "it runs";
  store().finish_cancel(id, claimed.fence, now);
  EXPECT_FALSE(store().add_artifact(id, claimed.fence + 1, preview));
  EXPECT_TRUE(store().add_artifact(id, claimed.fence, preview));
  ASSERT_EQ(find(id).artifacts.size(), 1u);
  EXPECT_EQ(find(id).artifacts[0].name, "preview.png");
  EXPECT_TRUE(store().is_artifact_referenced(preview.sha256));
  store().retry(id, now);
  EXPECT_TRUE(find(id).artifacts.empty());
  EXPECT_FALSE(store().is_artifact_referenced(preview.sha256));
  store().cancel(id, now);
  const Placed done = place(JobState::succeeded);
  EXPECT_FALSE(store().add_artifact(done.id, done.fence, preview)) << "it has its images";
}

TEST_P(JobStoreConformance, KeepsTheMovesOfAJobWithTheirReasons) {
  const auto text = [&](const std::string& id) {
    std::string all;
    for (const JobMove& move : store().moves(id))
      all += std::to_string(move.at - now) + " " + name_of(move.state) + " " + std::to_string(move.attempt) + " " +
             move.code + "/" + move.detail + "/" + move.worker + "; ";
    return all;
  };
  const std::string id = submit();
  EXPECT_EQ(text(id), "");
  const Claim first = claim();
  store().release(id, first.fence, now + 1,
                  {.counts = true, .code = "out_of_memory", .detail = "No memory, no image."});
  const Claim second = claim();
  store().fail(second.job.id, second.fence, now + 2, {"bad_scene", "It has 1 error.", {}});
  store().retry(id, now + 3);
  store().cancel(id, now + 4);
  EXPECT_EQ(text(id),
            "0 running 1 //boot; 1 queued 1 out_of_memory/No memory, no image./; 0 running 2 //boot; "
            "2 failed 2 bad_scene/It has 1 error./; 3 queued 0 retry/by request/; 4 cancelled 0 //; ");
  const std::string draft = submit([](Job& job) { job.keep = false; });
  store().cancel(draft, now);
  EXPECT_EQ(text(draft), "");
  store().remove(id);
  EXPECT_EQ(text(id), "");
  if (is_shared()) return;
  const std::string recovered = submit();
  claim();
  store().recover("another boot", now + 5);
  EXPECT_EQ(text(recovered), "0 running 1 //boot; 5 queued 0 daemon_ended//; ");
}

INSTANTIATE_TEST_SUITE_P(Stores, JobStoreConformance, testing::ValuesIn(store_kinds()),
                         [](const auto& kind) { return kind.param.name; });
