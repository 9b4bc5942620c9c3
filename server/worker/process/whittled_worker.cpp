/// whittled-worker: renders jobs that the daemon assigns over the socket it was started with (protocol.h). It exits
/// when the daemon closes the socket.

#include <fcntl.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "server/worker/process/jobs.h"
#include "server/worker/process/render_executor.h"
#include "server/worker/process/sandbox.h"
#include "server/worker/protocol/protocol.h"
#include "tracer/version.h"

namespace {

/// The first message of the daemon; none without a daemon.
std::optional<worker::Configure> receive_configuration() {
  worker::Received received = worker::receive(worker::worker_socket, worker::daemon_body_limit, worker::FileRule::any);
  auto* message = std::get_if<worker::Message>(&received);
  auto* configure = message == nullptr ? nullptr : std::get_if<worker::Configure>(message);
  if (configure == nullptr) return std::nullopt;
  return std::move(*configure);
}

bool is_started_by_daemon() {
  int type = 0;
  socklen_t size = sizeof type;
  return getsockopt(worker::worker_socket, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_SEQPACKET &&
         fcntl(worker::worker_socket, F_SETFD, FD_CLOEXEC) == 0;
}

/// If the machine runs out of memory, the kernel kills the worker rather than the daemon.
void set_oom_score() { std::ofstream("/proc/self/oom_score_adj") << "500"; }

/// The daemon stays responsive while renders use all cores. Threads that are started later inherit the priority.
/// Returns the nice level.
int lower_priority() { return ::nice(5); }

/// The first use of Embree and of the image library takes 0.2 s.
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

/// Loads all libraries and enters the sandbox. Returns the name of its restrictions, empty on failure.
std::string prepare(const worker::Options& options) {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  try {
    // Before the capabilities are dropped: without them root cannot pass a directory that only another user may.
    if (!worker::load_fonts()) std::fprintf(stderr, "whittled-worker: plots cannot be drawn\n");
    if (!worker::load_encoders()) return {};
    worker::limit_resources(options.slots, options.job_memory_bytes);
    const bool landlock = worker::restrict_files({program.parent_path().parent_path() / "lib/whittle"});
    if (!warm_up()) return {};
    worker::restrict_calls();
    return worker::sandbox_name(landlock);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "whittled-worker: no sandbox: %s\n", failure.what());
    return {};
  }
}

/// Never returns.
void serve(worker::RenderExecutor& executor, std::uint64_t job_memory_bytes) {
  for (;;) {
    worker::Received received = worker::receive(worker::worker_socket, worker::daemon_body_limit);
    auto* message = std::get_if<worker::Message>(&received);
    // Threads are not joined: there is no receiver for their results.
    if (message == nullptr) _exit(std::holds_alternative<worker::Closed>(received) ? 0 : 1);
    if (auto* job = std::get_if<worker::Assign>(message)) executor.assign(std::move(*job));
    if (auto* task = std::get_if<worker::ImageTask>(message); task != nullptr && task->work.kind == "live") {
      executor.make_live_form(std::move(*task));
    } else if (task != nullptr) {
      std::thread(worker::run_image_task, std::move(*task), job_memory_bytes, worker::worker_socket).detach();
    }
    if (const auto* request = std::get_if<worker::PreviewRequest>(message)) executor.request_preview(*request);
    if (const auto* cancel = std::get_if<worker::Cancel>(message)) executor.cancel(*cancel);
    if (auto* task = std::get_if<worker::TraceTask>(message)) executor.trace_task(std::move(*task));
    if (const auto* taken = std::get_if<worker::TaskTaken>(message)) executor.on_task_taken(*taken);
    if (auto* done = std::get_if<worker::TaskDone>(message)) executor.on_task_done(std::move(*done));
    if (const auto* helpers = std::get_if<worker::Helpers>(message)) executor.on_helpers(*helpers);
  }
}

}  // namespace

int main() {
  // Ctrl-C in a terminal signals every process, but the daemon decides about the end. It blocked the signals until now.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the limit is an error of its job
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);

  auto configuration = is_started_by_daemon() ? receive_configuration() : std::nullopt;
  if (!configuration) {
    std::fprintf(stderr, "whittled-worker is started by whittled and cannot run without it.\n");
    return 2;
  }
  const worker::Options& options = configuration->options;
  set_oom_score();
  const int nice_level = lower_priority();
  std::optional<oneapi::tbb::global_control> thread_limit;
  if (options.threads > 0) {
    thread_limit.emplace(oneapi::tbb::global_control::max_allowed_parallelism,
                         static_cast<std::size_t>(options.threads));
  }
  const std::string sandbox = prepare(options);
  if (sandbox.empty()) return 1;
  // Before the first heartbeat of the executor.
  worker::send(worker::worker_socket, worker::pack(worker::Ready{std::string(tracer::build()), sandbox}));
  worker::FileClient files(std::move(configuration->file_socket));
  worker::RenderExecutor executor(worker::worker_socket, options, files, nice_level);
  serve(executor, options.job_memory_bytes);
}
