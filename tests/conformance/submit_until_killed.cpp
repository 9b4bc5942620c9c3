/// submit_until_killed DIRECTORY ROUND: four threads submit jobs, claim one each time and end it
/// with an image, and write "ID SHA256\n" to standard output once all is acknowledged, without end.

#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include "server/storage/files/file_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/test_store.h"

int main(int, char** arguments) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // also if the test is killed
  const std::string directory = arguments[1], round = arguments[2];
  TestStore store(directory);
  storage::files::FileArtifactStore large(directory + "/artifacts");
  storage::sqlite::SmallArtifactStore artifacts(store.sqlite(), large);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 4; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = 0;; ++i) {
        queue::Job job;
        job.id = round + "-" + std::to_string(thread) + "-" + std::to_string(i);
        job.labels = {{"round", round}};
        store.submit(job, "document of " + job.id);
        const auto claim = store.claim(round, 1, 2, false);
        if (!claim) continue;
        const std::string& id = claim->job.id;
        const std::string bytes = "image of " + id + std::string(static_cast<std::size_t>(i % 7) * 9999, 'p');
        const auto stored = artifacts.put(MemoryFile(bytes).fd());
        store.succeed(id, claim->fence, 1, "{}", {{"image.png", "image/png", stored.sha256, stored.bytes}});
        const std::string line = id + " " + stored.sha256 + "\n";
        if (write(STDOUT_FILENO, line.data(), line.size()) < 0) _exit(1);  // shorter than PIPE_BUF: whole lines
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}
