/// The rendering worker, run by the supervisor.

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "server/queue/asset_store.h"
#include "server/worker/supervisor/child_process.h"
#include "tests/queue/supervised.h"

using queue::JobState;

namespace {

class WorkerTest : public SupervisorTest {
 protected:
  void start_real_worker() {
    start([](auto& with) { with.executable = worker::default_executable(); });
  }
  std::string artifact_of(const queue::Job& job, std::size_t index = 0) {
    return bytes_of(queue.queries.open(job.artifacts.at(index))).value_or("");
  }
};

std::string scene(int side, int samples, const std::string& formats) {
  return R"({"version": 1, "image": {"width": )" + std::to_string(side) + R"(, "height": )" + std::to_string(side) +
         R"(}, "camera": {"position": [0, 1, 5], "look_at": [0, 0, 0]},
             "lights": [{"type": "point", "position": [2, 5, 5]}],
             "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {"reflection": 0.3}},
                         {"type": "plane", "point": [0, -1, 0], "normal": [0, 1, 0], "material": {}}],
             "accuracy": {"samples": [)" +
         std::to_string(samples) + ", " + std::to_string(samples) + R"(]}, "output": {"formats": [)" + formats + "]}}";
}

}  // namespace

TEST_F(WorkerTest, RendersASceneIntoEachFormatWithAReport) {
  start_real_worker();
  const std::string id = submit(scene(16, 1, R"("png", "exr")"));
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  const queue::Job job = find(id);
  ASSERT_EQ(job.artifacts.size(), 2u);
  EXPECT_EQ(job.artifacts[0].name, "image.png");
  EXPECT_EQ(job.artifacts[0].media_type, "image/png");
  EXPECT_EQ(artifact_of(job).substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(job.artifacts[1].name, "image.exr");
  EXPECT_EQ(artifact_of(job, 1).substr(0, 4), "v/1\x01");
  EXPECT_NE(job.report.find("\"camera\":256"), std::string::npos) << job.report;
  EXPECT_NE(job.report.find("\"encode\""), std::string::npos) << job.report;
}

TEST_F(WorkerTest, FailsInvalidDocumentsWithTheirErrors) {
  start_real_worker();
  const std::string id = submit(R"({"version": 1, "objects": [{"type": "sphere", "radius": -1, "material": "glas"}]})");
  const std::string broken = submit("{");
  ASSERT_TRUE(reaches(id, JobState::failed));
  ASSERT_TRUE(reaches(broken, JobState::failed));
  EXPECT_EQ(problem_code(id), "bad_scene");
  EXPECT_FALSE(find(id).problem->errors.empty());
  EXPECT_EQ(problem_code(broken), "bad_scene");
  EXPECT_FALSE(find(broken).problem->detail.empty());
  EXPECT_EQ(log.count("worker_ended"), 0);
}

TEST_F(WorkerTest, ReportsProgressAndStopsARenderOnCancel) {
  start_real_worker();
  const std::string id = submit(scene(2000, 1000, R"("png")"));
  ASSERT_TRUE(eventually([&] { return queue.queries.progress(id) > 0; }));
  EXPECT_LT(queue.queries.progress(id), 1);
  queue.lifecycle.cancel(id);
  ASSERT_TRUE(reaches(id, JobState::cancelled));
  EXPECT_TRUE(eventually([&] { return supervisor->running() == 0; }));
  EXPECT_EQ(log.count("worker_ended"), 0) << "it stopped";
}

/// A ridged sheet as an OBJ file.
std::string sheet_file() {
  std::string positions, faces;
  for (int j = 0; j <= 50; ++j) {
    for (int i = 0; i <= 50; ++i) {
      positions += "v " + std::to_string(i) + " " + std::to_string(i * j % 7) + " " + std::to_string(j) + "\n";
      positions += "vt " + std::to_string(i / 50.0) + " " + std::to_string(j / 50.0) + "\n";
      const int at = j * 51 + i + 1;
      if (i == 50 || j == 50) continue;
      faces += "f";
      for (const int corner : {at, at + 51, at + 52, at + 1})
        faces += " " + std::to_string(corner) + "/" + std::to_string(corner);
      faces += "\n";
    }
  }
  return positions + faces;
}

class SceneCacheOfAWorker : public WorkerTest {
 protected:
  SceneCacheOfAWorker() {
    with.executable = worker::default_executable();
    with.files.uploads = path("uploads");
    upload(mesh, sheet_file());
  }
  void upload(const std::string& sha256, const std::string& bytes) const {
    const std::filesystem::path place = path("uploads/" + queue::asset_path(sha256));
    std::filesystem::create_directories(place.parent_path());
    std::ofstream(place, std::ios::binary) << bytes;
  }
  queue::Job render(const std::string& document) {
    const std::string id = submit(document);
    EXPECT_TRUE(reaches(id, JobState::succeeded)) << problem_code(id);
    return find(id);
  }
  /// The sheet from a height, with a color or the name of a texture.
  queue::Job frame(int height, const std::string& color) {
    return render(R"({"version": 1, "image": {"width": 32, "height": 32}, "camera": {"position": [25, )" +
                  std::to_string(height) + R"(, 80], "look_at": [25, 0, 25]},
             "lights": [{"type": "point", "position": [2, 50, 5]}], "output": {"formats": ["png"]},
             "objects": [{"type": "mesh", "file": "sha256:)" +
                  mesh + R"(", "material": {"color": )" + color + "}}]}");
  }
  static bool reports(const queue::Job& job, const std::string& words) {
    return job.report.find(words) != std::string::npos;
  }

  const std::string mesh = std::string(64, 'a');
  worker::SupervisorSettings with = settings();
};

TEST_F(SceneCacheOfAWorker, ReadsMeshAndImageFilesOfSeveralFramesOnce) {
  start(with);
  const std::string image(64, 'b'), texture = R"({"file": "sha256:)" + image + R"("})";
  upload(image, artifact_of(render(scene(128, 1, R"("png")"))));
  const queue::Job first = frame(20, texture);
  EXPECT_TRUE(reports(first, R"("geometry_reused":false,"textures":{"reused":0,"decoded":1})")) << first.report;
  std::filesystem::remove(path("uploads/" + queue::asset_path(mesh)));
  const queue::Job second = frame(30, texture);
  EXPECT_TRUE(reports(second, R"("geometry_reused":true,"textures":{"reused":1,"decoded":0})")) << second.report;
  EXPECT_TRUE(
      eventually([&] { return supervisor->cache_bytes().geometry > 0 && supervisor->cache_bytes().images > 0; }));

  upload(mesh, sheet_file());
  with.scene_cache_bytes = 0;
  supervisor.reset();
  start(with);
  const queue::Job alone = frame(30, texture);
  EXPECT_TRUE(reports(alone, R"("geometry_reused":false,"textures":{"reused":0,"decoded":1})")) << alone.report;
  EXPECT_EQ(alone.artifacts.at(0).sha256, second.artifacts.at(0).sha256);
  EXPECT_EQ(supervisor->cache_bytes().geometry, 0u);
  EXPECT_FALSE(reports(frame(20, texture), "\"geometry_reused\":true")) << "without a cache";
}

TEST_F(SceneCacheOfAWorker, IsClearedWhenIdle) {
  with.cache_idle_ms = 100;
  start(with);
  const auto built = [&] { return reports(frame(20, "1"), "\"geometry_reused\":false"); };
  EXPECT_TRUE(built());
  // The cache is empty until a heartbeat has reported the geometry, and once it is cleared. A job uses it in between.
  EXPECT_TRUE(eventually([&] { return supervisor->cache_bytes().geometry == 0 && built(); }));
}

/// The nice level of each thread of a process.
std::multiset<int> nice_levels(int pid) {
  std::multiset<int> levels;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task")) {
    std::ifstream file(task.path() / "stat");
    std::string text, field;
    std::getline(file, text);
    std::istringstream rest(text.substr(text.rfind(')') + 1));  // its name may have blanks
    for (int i = 3; i <= 19; ++i) rest >> field;                // proc(5)
    levels.insert(std::atoi(field.c_str()));
  }
  return levels;
}

TEST_F(WorkerTest, LowersThePriorityOfThreadsOfLargeJobs) {
  auto with = settings();
  with.slots = 3;
  with.threads = 2;
  for (const std::string level : {"0", "12"}) {  // of the daemon, if it is started by nice(1)
    with.executable = path("worker" + level);
    std::ofstream(with.executable) << "#!/bin/sh\nexec nice -n " << level << ' ' << worker::default_executable()
                                   << '\n';
    std::filesystem::permissions(with.executable, std::filesystem::perms::owner_all);
    supervisor.reset();
    start(with);
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(reaches(submit(scene(16, 1, R"("png")")), JobState::succeeded));
    const auto before = nice_levels(supervisor->worker_pid());
    EXPECT_EQ(before.count(*before.begin()), before.size()) << "small jobs keep the priority";
    const std::string large = submit_large(scene(2000, 1000, R"("png")"));
    ASSERT_TRUE(eventually([&] { return queue.queries.progress(large) > 0; }));
    const auto levels = nice_levels(supervisor->worker_pid());
    EXPECT_GT(levels.count(std::min(*before.begin() + 5, 19)), 0u) << "at level " << *before.begin();
    EXPECT_GT(levels.count(*before.begin()), 2u) << "threads without a large job";
    EXPECT_EQ(*levels.begin(), *before.begin()) << "no thread gets a higher priority";
    ASSERT_TRUE(reaches(submit(scene(16, 1, R"("png")")), JobState::succeeded));
    queue.lifecycle.cancel(large);
    ASSERT_TRUE(reaches(large, JobState::cancelled));
  }
}

TEST_F(WorkerTest, HasItsOwnSession) {
  start_real_worker();
  ASSERT_TRUE(reaches(submit(scene(16, 1, R"("png")")), JobState::succeeded));
  EXPECT_EQ(getsid(supervisor->worker_pid()), supervisor->worker_pid());
}

/// "VmRSS", "VmHWM": MiB that it has, or had at most.
std::uint64_t memory_mib(int pid, const std::string& field) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(field + ":")) return std::stoull(line.substr(field.size() + 1)) / 1024;
  return 0;
}

TEST_F(WorkerTest, ReturnsTheMemoryOfALargeJob) {
#ifdef WHITTLE_SANITIZED
  GTEST_SKIP() << "a sanitizer keeps freed memory";
#endif
  start_real_worker();
  ASSERT_TRUE(reaches(submit(scene(16, 1, R"("png")")), JobState::succeeded));
  const int pid = supervisor->worker_pid();
  const std::uint64_t before = memory_mib(pid, "VmRSS");
  ASSERT_TRUE(reaches(submit(scene(2500, 1, R"("png", "exr")")), JobState::succeeded));
  ASSERT_GT(memory_mib(pid, "VmHWM"), before + 64) << "a large job";
  EXPECT_TRUE(eventually([&] { return memory_mib(pid, "VmRSS") < before + 64; })) << memory_mib(pid, "VmRSS");
  EXPECT_EQ(supervisor->worker_pid(), pid);
}

TEST_F(WorkerTest, IgnoresSigintAndSigterm) {
  start_real_worker();
  ASSERT_TRUE(eventually([&] { return log.count("worker_ready") == 1; }));
  kill(supervisor->worker_pid(), SIGTERM);
  kill(supervisor->worker_pid(), SIGINT);
  EXPECT_TRUE(reaches(submit(scene(16, 1, R"("png")")), JobState::succeeded));
  EXPECT_EQ(log.count("worker_ended"), 0);
}

TEST_F(WorkerTest, RendersTheSameImageAfterBeingKilled) {
  start_real_worker();
  const std::string undisturbed = submit(scene(300, 16, R"("png")"));
  ASSERT_TRUE(reaches(undisturbed, JobState::succeeded));
  const std::string id = submit(scene(300, 16, R"("png")"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1 || ended(state(id)); }));
  kill(supervisor->worker_pid(), SIGKILL);
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(find(id).artifacts.at(0).sha256, find(undisturbed).artifacts.at(0).sha256);
}

TEST(Worker, ExitsWhenTheDaemonClosesTheSocket) {
  worker::ChildProcess process(worker::default_executable());
  process.send(worker::pack(worker::Configure{{}, worker::sealed_memory("instead of a socket")}));
  const auto ends = [&](int descriptor) {
    pollfd wanted{descriptor, POLLIN, 0};
    return poll(&wanted, 1, 60'000) == 1;
  };
  ASSERT_TRUE(ends(process.socket()));
  const worker::Received hello = process.receive();
  ASSERT_TRUE(std::holds_alternative<worker::Ready>(std::get<worker::Message>(hello)));
  process.send(worker::pack(worker::Assign{"job", 1, 0, scene(2000, 1000, R"("png")")}));
  shutdown(process.socket(), SHUT_RDWR);
  ASSERT_TRUE(ends(process.pid_descriptor()));
  EXPECT_EQ(process.reap(), "exited with status 0");
}

TEST(Worker, RejectsAStartWithoutADaemon) {
  const std::string command = worker::default_executable() + " 2>/dev/null 3>/dev/null";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 2);
}
