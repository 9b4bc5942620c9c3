#include "server/storage/sqlite/list_query.h"

namespace jobs::sqlite {
namespace {

/// Up to this many entries of an index are walked rather than compared with another index.
constexpr std::int64_t few = 1000;

/// Which index the page walks. Each holds the ids in order, so the walk ends when the page is full; the other
/// conditions are looked up by id.
enum class Walk { jobs, state, label };

Walk choose_walk(Database& database, const JobFilter& filter) {
  if (filter.labels.empty()) return filter.state ? Walk::state : Walk::jobs;
  if (!filter.state) return Walk::label;
  // Few of this state, or many of this label: the state is the shorter walk.
  const auto& [key, value] = *filter.labels.begin();
  Query labelled = database.query("SELECT count(*) FROM (SELECT 1 FROM labels WHERE key = ? AND value = ? LIMIT ?)",
                                  key, value, few);
  labelled.row();
  return labelled.integer(0) < few || count_jobs(database, *filter.state) > few ? Walk::label : Walk::state;
}

std::string list_sql(Walk walk, const JobFilter& filter) {
  std::string sql = "SELECT jobs.id FROM ";
  // CROSS JOIN: SQLite keeps the order written.
  if (walk == Walk::label) sql += "labels AS walked CROSS JOIN jobs ON jobs.id = walked.job_id";
  if (walk == Walk::state) sql += "jobs INDEXED BY jobs_by_state";
  if (walk == Walk::jobs) sql += "jobs";
  const std::string id = walk == Walk::label ? "walked.job_id" : "jobs.id";
  sql += " WHERE " + id + " < ?";
  bool walked_label = walk == Walk::label;
  for (std::size_t i = 0; i < filter.labels.size(); ++i) {
    sql += walked_label ? " AND walked.key = ? AND walked.value = ?"
                        : " AND EXISTS (SELECT 1 FROM labels WHERE key = ? AND value = ? AND job_id = jobs.id)";
    walked_label = false;
  }
  if (filter.state) sql += " AND jobs.state = ?";
  if (!filter.text.empty()) sql += " AND instr(jobs.name, ?) > 0";
  return sql + " ORDER BY " + id + " DESC LIMIT ?";
}

}  // namespace

std::vector<std::string> list_ids(Database& database, const JobFilter& filter, const std::string& cursor, int limit) {
  Query query = database.query(list_sql(choose_walk(database, filter), filter));
  int position = 0;
  const std::string after_every_id = "~";
  query.bind(++position, cursor.empty() ? after_every_id : cursor);
  for (const auto& [key, value] : filter.labels) {
    query.bind(++position, key);
    query.bind(++position, value);
  }
  if (filter.state) query.bind(++position, std::string(name_of(*filter.state)));
  if (!filter.text.empty()) query.bind(++position, filter.text);
  query.bind(++position, std::int64_t{limit});
  std::vector<std::string> ids;
  while (query.row()) ids.push_back(query.text(0));
  return ids;
}

std::int64_t count_jobs(Database& database, JobState state) {
  Query query = database.query("SELECT jobs FROM job_counts WHERE state = ?", std::string(name_of(state)));
  query.row();
  return query.integer(0);
}

}  // namespace jobs::sqlite
