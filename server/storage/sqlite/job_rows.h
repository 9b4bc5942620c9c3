#pragma once
/// Jobs to rows and back. Private to this directory.

#include <map>
#include <string>
#include <vector>

#include "server/queue/job.h"
#include "server/storage/sqlite/database.h"

namespace queue::sqlite {

void insert_job(Database& database, const Job& job, const std::string& document);
void insert_labels(Database& database, const std::string& id, const std::map<std::string, std::string>& labels);
void insert_report(Database& database, const std::string& id, const std::string& report);
void insert_problem(Database& database, const std::string& id, const Problem& problem);
/// Of a job whose row is there.
void insert_artifacts(Database& database, const std::string& id, const std::vector<Artifact>& artifacts);

std::optional<Job> read_job(Database& database, const std::string& id);
std::vector<Artifact> read_artifacts(Database& database, const std::string& id);

}  // namespace queue::sqlite
