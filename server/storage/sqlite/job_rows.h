#pragma once
/// Conversion of jobs, batches and replies to rows and back. Private to this directory.

#include <map>
#include <string>
#include <vector>

#include "server/queue/job_store.h"
#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

void insert_job(Database& database, const queue::Job& job, const std::string& document);
void insert_labels(Database& database, const std::string& id, const std::map<std::string, std::string>& labels);
void insert_report(Database& database, const std::string& id, const std::string& report);
void insert_problem(Database& database, const std::string& id, const queue::Problem& problem);
/// Precondition: the row of the job exists.
void insert_artifacts(Database& database, const std::string& id, const std::vector<queue::Artifact>& artifacts,
                      bool synced);

std::optional<queue::Job> read_job(Database& database, const std::string& id);
std::optional<std::string> read_document(Database& database, const std::string& id);
std::vector<queue::Artifact> read_artifacts(Database& database, const std::string& id);

void insert_batch(Database& database, const queue::Batch& batch);
std::optional<queue::BatchState> read_batch(Database& database, const std::string& id);

/// Replaces an expired reply under the same key.
void insert_reply(Database& database, const queue::KeptReply& kept);
/// None if it has expired.
std::optional<queue::KeptReply> read_reply(Database& database, const queue::ReplyKey& key, std::int64_t now);

}  // namespace storage::sqlite
