#pragma once
/// The queue: its parts, connected, over the stores.
///
///   storage::sqlite::SqliteStores stores(directory);               // server/storage/sqlite/sqlite_stores.h
///   storage::files::FileArtifactStore artifacts(directory);        // server/storage/files/file_artifact_store.h
///   queue::IdSource ids(queue::system_clock(), queue::system_random());
///   queue::Queue queue(stores.all(), artifacts, ids, queue::system_clock(), log, settings);
///   worker::Supervisor supervisor(queue, worker_settings, log);    // server/worker/supervisor/supervisor.h
///   auto submitted = queue.submission.submit(submission);

#include "server/queue/job_lifecycle.h"
#include "server/queue/job_queries.h"
#include "server/queue/job_submission.h"
#include "server/queue/queue_context.h"

namespace queue {

/// The stores and `ids` must outlive it.
class Queue {
 private:
  QueueContext context_;

 public:
  Queue(const Stores& stores, ArtifactStore& artifacts, IdSource& ids, Clock clock, const Log& log,
        QueueSettings settings)
      : context_(stores, artifacts, ids, std::move(clock), log, std::move(settings)), lifecycle(context_, log) {}

  AttachedRunner& runner = context_.runner;
  JobNotifications& notifications = context_.notifications;
  JobWaiters& waiters = context_.waiters;
  JobSubmission submission{context_};
  JobLifecycle lifecycle;
  JobQueries queries{context_};
};

}  // namespace queue
