#pragma once
/// The task --copy-to: from a data directory to a database and bucket that nodes share, or back.

#include <string>

#include "server/daemon/config.h"

namespace whittled {

/// Copies the data of a stopped daemon (storage::copy::copy_all) and prints the progress to stderr. `to` is the
/// connection URI of a database: then the source is the directory `data`, and the images go to `artifacts`. Or it is a
/// new data directory, which appears when it is complete: then the source is `database` with `artifacts`. An
/// interrupted copy is continued by the same command. Throws with the reason.
void copy_data(const Config& config, const std::string& to);

/// The options that do not fit to `to`.
std::vector<ConfigError> find_copy_errors(const Config& config, const std::string& to);

}  // namespace whittled
