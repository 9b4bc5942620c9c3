/// queue_bench DIRECTORY [SECONDS]: how fast the queue is on this disk, with SQLite and files.
///   durable submits/s and their latency from 8 threads, claims and ends of jobs by the supervisor with a worker that
///   does nothing (fake_worker) and with the one that renders 16x16 (whittled-worker), and pages of 100,000 jobs.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "server/queue/queue.h"
#include "server/storage/files/file_artifact_store.h"
#include "server/storage/sqlite/sqlite_job_store.h"
#include "server/worker/supervisor/supervisor.h"

namespace {

using Clock = std::chrono::steady_clock;

double ms_of(const std::function<void()>& call) {
  const auto start = Clock::now();
  call();
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

struct Daemon {
  explicit Daemon(const std::string& directory) : store(directory), artifacts(directory + "/artifacts") {}
  queue::SqliteJobStore store;
  queue::FileArtifactStore artifacts;
  queue::IdSource ids{queue::system_clock(), queue::system_random()};
  queue::Queue queue{store, artifacts, ids, queue::system_clock(), queue::no_log(), {.queued_limit = 10'000'000}};
};

std::string small_scene(std::uint64_t seed) {
  return R"({"version": 1, "image": {"width": 16, "height": 16}, "camera": {"position": [0, 1, 5], "forward_preview_request": [0, 0, 0]},
    "lights": [{"type": "point", "position": [2, 5, 5]}], "accuracy": {"samples": [4, 4], "seed": )" +
         std::to_string(seed) + R"(}, "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1,
    "material": {"reflection": 0.3}}, {"type": "plane", "point": [0, -1, 0], "normal": [0, 1, 0], "material": {}}]})";
}

void bench_submits(Daemon& daemon, int seconds) {
  const std::string document = small_scene(0) + std::string(1500, ' ');
  std::vector<std::vector<double>> latencies(8);
  std::vector<std::thread> threads;
  const auto end = Clock::now() + std::chrono::seconds(seconds);
  for (auto& mine : latencies) {
    threads.emplace_back([&] {
      api::Document parsed;
      parsed.job.labels = {{"batch", "bench"}};
      while (Clock::now() < end)
        mine.push_back(ms_of([&] { (void)daemon.queue.submit({.document = document, .parsed = parsed}); }));
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::vector<double> all;
  for (const auto& mine : latencies) all.insert(all.end(), mine.begin(), mine.end());
  std::sort(all.begin(), all.end());
  std::printf("submit, 8 threads: %.0f durable submits/s, p50 %.2f ms, p99 %.2f ms, max %.2f ms\n",
              static_cast<double>(all.size()) / seconds, all[all.size() / 2], all[all.size() * 99 / 100], all.back());
}

void bench_jobs(const std::string& directory, const char* worker_name, int slots, const std::string& prefix, int jobs) {
  Daemon daemon(directory);
  for (int i = 0; i < jobs; ++i) {
    const auto seed = static_cast<std::uint64_t>(i);
    (void)daemon.queue.submit({.document = prefix.empty() ? small_scene(seed) : prefix + std::to_string(i)});
  }
  worker::SupervisorSettings settings;
  settings.executable = std::filesystem::read_symlink("/proc/self/exe").parent_path() / worker_name;
  settings.slots = slots;
  const worker::Supervisor supervisor(daemon.queue, settings, queue::no_log());
  const auto done = [&] { return daemon.store.count(queue::JobState::succeeded); };
  while (done() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the worker's start is not measured
  const std::int64_t before = done();
  const double ms = ms_of([&] {
    while (done() < jobs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  std::printf("%s, %d slots: %.0f jobs/s\n", worker_name, slots, 1000.0 * static_cast<double>(jobs - before) / ms);
}

/// From the request to the end of the job, in the middle of a render on all cores.
void bench_cancels(const std::string& directory) {
  Daemon daemon(directory);
  std::string scene = small_scene(0);
  scene.replace(scene.find(R"("width": 16, "height": 16)"), 25, R"("width": 4000, "height": 4000)");
  worker::SupervisorSettings settings;
  settings.executable = worker::worker_beside_this_program();
  const worker::Supervisor supervisor(daemon.queue, settings, queue::no_log());
  std::vector<double> times;
  for (int i = 0; i < 50; ++i) {
    const std::string id = daemon.queue.submit({.document = scene})->view.job.id;
    while (daemon.queue.progress(id) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::binary_semaphore ended{0};
    times.push_back(ms_of([&] {
      daemon.queue.when_ended(id, [&] { ended.release(); });
      daemon.queue.cancel(id);
      ended.acquire();
    }));
  }
  std::sort(times.begin(), times.end());
  std::printf("cancel in mid-render: median %.1f ms, max %.1f ms\n", times[25], times.back());
}

void bench_pages(const std::string& directory, int count) {
  Daemon daemon(directory);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 16; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = thread; i < count; i += 16) {
        api::Document parsed;
        parsed.job.name = "frame " + std::to_string(i);
        parsed.job.labels = {{"all", "1"}, {"batch", std::to_string(i / 60)}};
        (void)daemon.queue.submit({.document = "{}", .parsed = parsed});
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  // The oldest fail, the others succeed: the worst order for a walk from the newest.
  for (int i = 0; i < count; ++i) {
    const queue::Claim claim = *daemon.queue.claim(false);
    if (i >= 2000) break;
    daemon.queue.fail(claim.job.id, claim.fence, {"internal", "bench", {}});
  }
  const auto page = [&](const char* what, const queue::JobFilter& filter) {
    std::size_t found = 0;
    std::vector<double> times;
    for (int i = 0; i < 20; ++i) {
      times.push_back(ms_of([&] { found = daemon.queue.list(filter, "", 50).items.size(); }));
    }
    std::sort(times.begin(), times.end());
    std::printf("page of 50 of %d jobs, %-46s %2zu found, median %.2f ms, max %.2f ms\n", count, what, found, times[10],
                times.back());
  };
  using enum queue::JobState;
  page("newest:", {});
  page("state queued:", {queued, {}, {}, ""});
  page("state failed (2,000, the oldest):", {failed, {}, {}, ""});
  page("label of 60:", {{}, {{"batch", "7"}}, {}, ""});
  page("label of all and state running (1):", {running, {{"all", "1"}}, {}, ""});
  page("label of all and state failed (the oldest):", {failed, {{"all", "1"}}, {}, ""});
  page("label of all and label of 60:", {{}, {{"all", "1"}, {"batch", "7"}}, {}, ""});
  page("text in one of the newest:", {{}, {}, {}, "frame 9999"});
  page("text in none:", {{}, {}, {}, "nothing"});
  for (int i = 0; i < 3; ++i) bench_submits(daemon, 3);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) return 2;
  const std::string directory = arguments[1];
  const int seconds = count > 2 ? std::atoi(arguments[2]) : 5;
  std::filesystem::create_directories(directory);
  {
    Daemon daemon(directory + "/submit");
    bench_submits(daemon, seconds);
  }
  bench_jobs(directory + "/noop", "fake_worker", 2, "finish ", 1000 * seconds);
  bench_jobs(directory + "/noop8", "fake_worker", 8, "finish ", 1000 * seconds);
  bench_jobs(directory + "/render", "whittled-worker", 2, "", 400 * seconds);
  bench_cancels(directory + "/cancel");
  bench_pages(directory + "/pages", 100'000);
}
