#pragma once
/// The tables of the SQLite files, with their versions. Private to this directory.

#include <cstdint>
#include <string>

namespace storage::sqlite {

inline constexpr std::int64_t jobs_schema_version = 15;
inline constexpr std::int64_t deliveries_schema_version = 3;
std::string jobs_schema();
std::string deliveries_schema();
/// Run on every connection to the jobs: names that the stores read and other databases have as views of several tables.
inline constexpr const char* jobs_views = "CREATE TEMP VIEW owners AS SELECT * FROM owner_usage";

}  // namespace storage::sqlite
