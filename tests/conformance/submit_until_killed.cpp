/// submit_until_killed FOLDER ROUND: submits jobs from four threads to a SqliteJobStore, and stores an artifact for
/// each in a FileArtifactStore, and writes "ID SHA256\n" to standard output once both are acknowledged. For ever.

#include <unistd.h>

#include <string>
#include <thread>
#include <vector>

#include "server/storage/files/file_artifact_store.h"
#include "server/storage/sqlite/sqlite_job_store.h"
#include "tests/conformance/memory_file.h"

int main(int, char** arguments) {
  const std::string folder = arguments[1], round = arguments[2];
  jobs::SqliteJobStore store(folder);
  jobs::FileArtifactStore artifacts(folder + "/artifacts");
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 4; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = 0;; ++i) {
        jobs::Job job;
        job.id = round + "-" + std::to_string(thread) + "-" + std::to_string(i);
        job.labels = {{"round", round}};
        const std::string bytes = "picture of " + job.id + std::string(static_cast<std::size_t>(i % 7) * 9999, 'p');
        const std::string sha256 = artifacts.put(MemoryFile(bytes).fd()).sha256;
        store.submit(job, "document of " + job.id);
        const std::string line = job.id + " " + sha256 + "\n";
        if (write(STDOUT_FILENO, line.data(), line.size()) < 0) _exit(1);  // shorter than PIPE_BUF: whole lines
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}
