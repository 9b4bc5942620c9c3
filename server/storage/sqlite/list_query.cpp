#include "server/storage/sqlite/list_query.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace storage::sqlite {
namespace {

/// Counting stops here: longer walks cost the same.
constexpr std::int64_t many = 1000;

using Label = std::pair<std::string, std::string>;

/// The index that a page walks. Each holds the ids in order, so the walk ends when the page is full; the other
/// conditions are checked by id.
struct Walk {
  enum class Over { jobs, state, label, batch };
  Over over = Over::jobs;
  Label label;
};

std::int64_t count_labelled(Database& database, const Label& label) {
  Query query = database.query("SELECT count(*) FROM (SELECT 1 FROM labels WHERE key = ? AND value = ? LIMIT ?)",
                               label.first, label.second, many);
  query.row();
  return query.integer(0);
}

/// The shortest walk: the rarest label, or the state where that is rarer.
Walk choose_walk(Database& database, const queue::JobFilter& filter) {
  Walk walk;
  if (!filter.batch.empty()) return {Walk::Over::batch, {}};
  std::int64_t shortest = std::numeric_limits<std::int64_t>::max();
  for (const auto& [key, value] : filter.labels) {
    const Label label(key, value);
    const std::int64_t count = count_labelled(database, label);
    if (count < shortest) walk = {Walk::Over::label, label};
    shortest = std::min(shortest, count);
  }
  if (filter.state && count_jobs(database, *filter.state) < shortest) walk.over = Walk::Over::state;
  return walk;
}

std::string list_sql(Walk::Over over, std::size_t other_labels, const queue::JobFilter& filter) {
  std::string sql = "SELECT jobs.id FROM ";
  std::string id = "jobs.id";
  switch (over) {
    case Walk::Over::label:  // CROSS JOIN: SQLite keeps the order written
      id = "walked.job_id";
      sql +=
          "labels AS walked CROSS JOIN jobs ON jobs.id = walked.job_id WHERE walked.key = ? AND walked.value = ? AND ";
      break;
    case Walk::Over::state:
      sql += "jobs INDEXED BY jobs_by_state WHERE ";
      break;
    case Walk::Over::batch:
      sql += "jobs INDEXED BY jobs_by_batch WHERE jobs.batch_id = ? AND ";
      break;
    case Walk::Over::jobs:
      sql += "jobs WHERE ";
      break;
  }
  sql += id + " < ?";
  if (filter.state) sql += " AND jobs.state = ?";
  for (std::size_t i = 0; i < other_labels; ++i) {
    sql += " AND EXISTS (SELECT 1 FROM labels WHERE key = ? AND value = ? AND job_id = jobs.id)";
  }
  if (!filter.text.empty()) sql += " AND instr(jobs.name, ?) > 0";
  return sql + " ORDER BY " + id + " DESC LIMIT ?";
}

}  // namespace

std::vector<std::string> list_ids(Database& database, const queue::JobFilter& filter, const std::string& cursor,
                                  int limit) {
  const Walk walk = choose_walk(database, filter);
  std::map<std::string, std::string> others = filter.labels;
  if (walk.over == Walk::Over::label) others.erase(walk.label.first);

  Query query = database.query(list_sql(walk.over, others.size(), filter));
  int position = 0;
  if (walk.over == Walk::Over::label) {
    query.bind(++position, walk.label.first);
    query.bind(++position, walk.label.second);
  }
  if (walk.over == Walk::Over::batch) query.bind(++position, filter.batch);
  query.bind(++position, cursor.empty() ? std::string("~") : cursor);  // greater than every id
  if (filter.state) query.bind(++position, std::string(queue::name_of(*filter.state)));
  for (const auto& [key, value] : others) {
    query.bind(++position, key);
    query.bind(++position, value);
  }
  if (!filter.text.empty()) query.bind(++position, filter.text);
  query.bind(++position, std::int64_t{limit});
  std::vector<std::string> ids;
  while (query.row()) ids.push_back(query.text(0));
  return ids;
}

std::int64_t count_jobs(Database& database, queue::JobState state) {
  Query query = database.query("SELECT jobs FROM job_counts WHERE state = ?", std::string(queue::name_of(state)));
  query.row();
  return query.integer(0);
}

}  // namespace storage::sqlite
