/// whittled-worker: renders the jobs that a daemon hands it over the socket it was started with (protocol.h).
/// It ends at once when the daemon's end of the socket does, and on nothing else the daemon did not ask for.

#include <fcntl.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <vector>

#include "server/worker/process/measure_job.h"
#include "server/worker/process/render_executor.h"
#include "server/worker/process/render_job.h"
#include "server/worker/process/sandbox.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/protocol/worker_options.h"
#include "tracer/version.h"

namespace {

bool is_started_by_a_daemon() {
  int type = 0;
  socklen_t size = sizeof type;
  return getsockopt(worker::worker_socket, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_SEQPACKET &&
         fcntl(worker::worker_socket, F_SETFD, FD_CLOEXEC) == 0;
}

/// When the machine runs out of memory, it is the render that goes, not the daemon.
void set_oom_score() { std::ofstream("/proc/self/oom_score_adj") << "500"; }

/// The daemon answers while renders keep all cores busy: it needs little, and that at once. Renders lose nothing by it
/// on a machine that has nothing else to do. Before any other thread, which then inherit it.
void lower_priority() { [[maybe_unused]] const int level = ::nice(5); }

/// Embree's device and the image library take 0.2 s on first use; that is paid before the first job comes.
bool warm_up() {
  const std::string_view scene = R"({"version": 1, "image": {"width": 4, "height": 4},
    "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0]}, "lights": [{"type": "point", "position": [0, 5, 5]}],
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {}},
                {"type": "triangle", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "material": {}}],
    "output": {"formats": ["png", "exr"]}})";
  worker::JobControl control;
  oneapi::tbb::task_arena arena;
  const worker::Outcome outcome = arena.execute([&] {
    return worker::render_job({"warm-up", 0, 0, std::string(scene)}, {}, control, nullptr);
  });
  if (const auto* failed = std::get_if<worker::Failed>(&outcome)) {
    std::fprintf(stderr, "whittled-worker: cannot render: %s\n", failed->problem.detail.c_str());
  }
  return std::holds_alternative<worker::Finished>(outcome);
}

/// Ready for what comes from outside: everything is loaded, and held. What it is held by; empty where it cannot be.
std::string prepare(const worker::Options& options) {
  const worker::FileSettings& files = options.files;
  std::vector<std::string> directories;
  if (!files.directory.empty()) directories.push_back(files.directory);
  if (!files.uploads.empty()) directories.push_back(files.uploads);
  const bool opens_files = !directories.empty();
  directories.push_back(std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() / "lib/whittle");
  try {
    if (!worker::load_fonts()) std::fprintf(stderr, "whittled-worker: charts cannot be drawn\n");
    worker::limit_resources(options.slots, options.job_memory_bytes);
    const bool landlock = worker::restrict_files(directories);
    if (!warm_up()) return {};
    worker::restrict_calls(opens_files);
    return worker::sandbox_name(landlock);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "whittled-worker: no sandbox: %s\n", failure.what());
    return {};
  }
}

/// Never returns.
void serve(worker::RenderExecutor& workshop) {
  for (;;) {
    worker::Received received = worker::receive(worker::worker_socket, worker::daemon_body_limit);
    auto* message = std::get_if<worker::Message>(&received);
    // Without goodbye to the threads: nobody is left to hear what they make.
    if (message == nullptr) _exit(std::holds_alternative<worker::Closed>(received) ? 0 : 1);
    if (auto* job = std::get_if<worker::Assign>(message)) workshop.assign(std::move(*job));
    if (auto* look = std::get_if<worker::Look>(message)) workshop.look(*look);
    if (auto* cancel = std::get_if<worker::Cancel>(message)) workshop.cancel(cancel->job_id);
  }
}

}  // namespace

int main(int count, char** arguments) {
  // A terminal's Ctrl-C goes to every process; the daemon decides what it means. It blocked them until now.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);

  const auto options = worker::parse_options({arguments + 1, arguments + count});
  if (!options || !is_started_by_a_daemon()) {
    std::fprintf(stderr, "whittled-worker is started by whittled, and of no use without it.\n");
    return 2;
  }
  set_oom_score();
  lower_priority();
  std::optional<oneapi::tbb::global_control> thread_limit;
  if (options->threads > 0) {
    thread_limit.emplace(oneapi::tbb::global_control::max_allowed_parallelism,
                         static_cast<std::size_t>(options->threads));
  }
  const std::string sandbox = prepare(*options);
  if (sandbox.empty()) return 1;
  // First of all messages: the workshop's heartbeats begin with the workshop.
  worker::send(worker::worker_socket, worker::pack(worker::Hello{std::string(tracer::build()), sandbox}));
  worker::RenderExecutor workshop(worker::worker_socket, *options);
  serve(workshop);
}
