/// Checks of the files, directories and addresses that a configuration names.

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <exception>
#include <filesystem>
#include <functional>
#include <system_error>
#include <utility>

#include "server/daemon/wiring.h"
#include "server/http/listener.h"
#include "server/support/descriptor.h"
#include "server/worker/protocol/asset_directory.h"

namespace whittled {
namespace {

namespace fs = std::filesystem;
using Errors = std::vector<ConfigError>;

/// Adds the message of the exception that `check` throws.
void add_failure(const char* flag, Errors& errors, const std::function<void()>& check) {
  try {
    check();
  } catch (const std::exception& failure) {
    errors.push_back({flag, failure.what()});
  }
}

/// Throws if the directory neither exists nor can be created, or is not writable.
void check_writable(const std::string& directory) {
  fs::path existing = fs::absolute(directory).lexically_normal();
  while (!fs::exists(existing) && existing.has_relative_path()) existing = existing.parent_path();
  if (!fs::is_directory(existing)) throw std::runtime_error(existing.string() + " is not a directory");
  if (::access(existing.c_str(), R_OK | W_OK | X_OK) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot write into " + existing.string());
}

/// Adds the failures to listen that have the code `address_in_use`, or those that do not.
void add_listen_failures(const Config& config, bool in_use, Errors& errors) {
  for (const auto& [flag, address] :
       {std::pair("--listen", config.listen), {"--health-listen", config.health_listen}}) {
    if (config.role == "worker" && address == config.listen) continue;
    try {
      (void)http::Listener(address.host, address.port);
    } catch (const std::system_error& failure) {
      if ((failure.code() == std::errc::address_in_use) == in_use) errors.push_back({flag, failure.what()});
    }
  }
}

void add_shared_files_errors(const Config& config, Errors& errors) {
  if (config.artifacts.empty()) {
    if (config.artifact_redirect == "on") errors.push_back({"--artifact-redirect", "needs --artifacts with a bucket"});
    return;
  }
  const auto bucket = bucket_settings(config);
  if (!bucket) return errors.push_back(bucket.error());
  if (config.database.empty()) errors.push_back({"--artifacts", "needs --database, which lists what the nodes share"});
  if (!*bucket && config.artifact_redirect == "on")
    errors.push_back({"--artifact-redirect", "needs --artifacts with a bucket"});
  add_failure("--artifacts", errors, [&] { check_shared_files(config); });
}

}  // namespace

std::vector<ConfigError> find_start_errors(const Config& config) {
  Errors errors;
  if (const auto credentials = read_credentials(config); !credentials) errors = credentials.error();
  if (!config.assets.empty()) add_failure("--assets", errors, [&] { (void)worker::AssetDirectory(config.assets); });
  add_failure("--data", errors, [&] {
    check_writable(config.data);
    if (config.database.empty()) check_database(config);
  });
  if (!config.database.empty()) add_failure("--database", errors, [&] { check_database(config); });
  add_shared_files_errors(config, errors);
  add_listen_failures(config, false, errors);
  const std::string worker = worker::default_executable();
  if (::access(worker.c_str(), X_OK) != 0) errors.push_back({worker, "is missing or cannot be executed"});
  return errors;
}

std::vector<ConfigError> find_conflicts(const Config& config) {
  Errors conflicts;
  add_listen_failures(config, true, conflicts);
  const support::Descriptor lock(::open((config.data + "/lock").c_str(), O_RDONLY | O_CLOEXEC));
  if (lock && ::flock(lock.get(), LOCK_SH | LOCK_NB) != 0)
    conflicts.push_back({"--data", config.data + " is in use by another daemon"});
  return conflicts;
}

}  // namespace whittled
