/// kill -9 during submissions: no acknowledged job or artifact is lost or damaged.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <sstream>

#include "server/storage/files/file_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"
#include "tracer/sha256.h"

using namespace queue;
using namespace storage::files;
using namespace storage::sqlite;

namespace {

/// Runs the program until it has acknowledged `lines` jobs, kills it, and returns all it acknowledged.
std::string acknowledged_before_kill(const std::string& directory, int round, int lines) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  std::string program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "submit_until_killed";
  std::string directory_argument = directory, round_argument = std::to_string(round);
  char* arguments[] = {program.data(), directory_argument.data(), round_argument.data(), nullptr};
  pid_t child = -1;
  const int error = posix_spawn(&child, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) throw std::runtime_error("cannot start " + program);

  std::string text;
  char chunk[4096];
  bool killed = false;
  for (;;) {
    const ssize_t got = read(ends[0], chunk, sizeof chunk);
    if (got <= 0) break;  // the program is gone, and the pipe is empty
    text.append(chunk, static_cast<std::size_t>(got));
    if (!killed && std::count(text.begin(), text.end(), '\n') >= lines) {
      kill(child, SIGKILL);
      killed = true;
    }
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(killed && WIFSIGNALED(status)) << "it ended by itself after: " << text;
  return text;
}

/// Empty where it does not exist.
std::string bytes_of(const std::string& sha256, ArtifactStore& artifacts) {
  const auto reader = artifacts.open(sha256);
  if (!reader) return {};
  std::string bytes(reader->size_bytes(), '\0');
  reader->read(0, bytes.data(), bytes.size());
  return bytes;
}

}  // namespace

TEST(KillNine, LosesNoAcknowledgedJobAndNoArtifactInFortyRounds) {
  const TemporaryDirectory directory;
  int checked = 0;
  for (int round = 0; round < 40; ++round) {
    std::istringstream acknowledged(acknowledged_before_kill(directory.path(), round, 1 + round * 37 % 60));
    TestStore store(directory.path());
    FileArtifactStore large(directory.path() + "/artifacts");
    SmallArtifactStore artifacts(store.sqlite(), large);
    for (std::string id, sha256; acknowledged >> id >> sha256; ++checked) {
      ASSERT_EQ(store.document(id), "document of " + id) << "round " << round;
      ASSERT_EQ(store.find(id)->artifacts.at(0).sha256, sha256) << id << " in round " << round;
      ASSERT_EQ(tracer::sha256_hex(bytes_of(sha256, artifacts)), sha256) << id << " in round " << round;
    }
    const JobFilter of_round{.state = {}, .labels = {{"round", std::to_string(round)}}, .batch = {}, .text = {}};
    const JobPage page = store.list(of_round, "", 100'000);
    for (const Job& job : page.items) {
      ASSERT_EQ(store.document(job.id), "document of " + job.id);
      for (const Artifact& artifact : job.artifacts) {
        ASSERT_EQ(tracer::sha256_hex(bytes_of(artifact.sha256, artifacts)), artifact.sha256) << "acknowledged or not";
      }
    }
  }
  EXPECT_GE(checked, 40);
  RecordProperty("acknowledged", checked);
}
