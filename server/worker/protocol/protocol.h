#pragma once
/// The messages between daemon and worker, and their transport over a socket pair.
///
/// A packet is one message (SOCK_SEQPACKET): a header with the protocol version, the kind of message and the size of
/// the body, then the body. A body of more than a few KiB, and every image, travels in sealed memory beside the packet
/// (SCM_RIGHTS). A second socket serves the files of scenes, which the daemon opens for the worker. Byte order and
/// sizes are those of the machine, because both ends are from one build.
///
/// The daemon sends Configure, and the worker Ready once it can render. Then the daemon assigns jobs, never more at
/// once than the worker has slots, and the worker answers each with exactly one of Finished, Failed, Cancelled. A
/// worker exits as soon as its socket is closed, for example because the daemon has crashed.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

#include "api/report.h"
#include "server/queue/job.h"
#include "server/queue/job_runner.h"
#include "server/queue/task_store.h"
#include "server/support/descriptor.h"
#include "tracer/limits.h"

namespace worker {

using support::Descriptor;

// ---- daemon to worker

/// The files that scenes may name. The daemon opens them; only the worker reads them, so it applies the limits on their
/// content.
struct FileSettings {
  std::string directory;  ///< empty: files are not allowed
  std::string uploads;    ///< directory of uploads, named by their sha256 (queue::asset_path); empty: not allowed
  std::uint64_t objects = tracer::Limits{}.objects;
  std::uint64_t triangles = tracer::Limits{}.triangles;
  bool operator==(const FileSettings&) const = default;
};

struct Options {
  int slots = 1;                                 ///< jobs at once, 1..4096
  int threads = 0;                               ///< shared by all jobs, 0..1024; 0: those of the machine
  std::uint64_t job_memory_bytes = 16ull << 30;  ///< limit for each job
  std::uint64_t scene_cache_bytes = 0;           ///< limit of tracer::SceneCache
  std::uint64_t cache_idle_ms = 60'000;          ///< the cache is cleared after this time without a job
  FileSettings files;
  bool operator==(const Options&) const = default;
  [[nodiscard]] int thread_count() const {
    return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }
};

/// The first message.
struct Configure {
  Options options;
  Descriptor file_socket;  ///< for FileRequest and FileResponse
};
struct Assign {
  std::string job_id;
  std::int64_t fence = 0;  ///< returned with the answer
  double queue_ms = 0;     ///< time in the queue, for the report
  std::string document;
  std::string kind{"render"};  ///< name of a queue::JobKind
  bool large = false;          ///< see queue::Job
  bool divisible = false;      ///< the job may publish tasks
  bool resumes = false;        ///< results of its tasks are stored
};
/// Cancelled follows soon, or Finished or Failed if the worker was faster. Unknown jobs are ignored.
struct Cancel {
  std::string job_id;
  bool preview = false;  ///< a PreviewResponse of the image so far follows the answer, unless there are no pixels
};
/// PreviewResponse follows once there are pixels, unless the job ends first. Unknown jobs are ignored.
struct PreviewRequest {
  std::string job_id;
  std::uint32_t side = 0;  ///< pixels along the longer side, at most queue::preview_side_max
};
/// Work on images that are finished, or on a scene (queue::ImageTask). ImageTaskResult follows.
struct ImageTask {
  std::uint64_t number = 0;  ///< returned with the result
  queue::ImageWork work;
  std::vector<Descriptor> images;
};

/// Part of the image of a job that another node runs. TaskTraced follows.
struct TraceTask {
  std::string job_id, key;
  std::string document;
  std::string part;
};
/// Answer to TakeTask.
struct TaskTaken {
  std::string job_id;
  std::string key;           ///< empty: all are done, or traced by others
  std::int64_t attempt = 1;  ///< number of claims
};
/// Result of a published task that others have traced.
struct TaskDone {
  std::string job_id, key;
  std::string node;          ///< that traced it
  std::int64_t attempt = 1;  ///< number of claims
  std::string result;
};
/// Sent every second while a divisible job runs.
struct Helpers {
  std::int64_t count = 0;  ///< other nodes that have nothing to do
};

// ---- worker to daemon

struct Ready {
  std::string build;      ///< tracer::build()
  std::string sandbox{};  ///< names of its restrictions; full_sandbox where the kernel has them all
};
inline constexpr const char* full_sandbox = "seccomp, landlock";
/// Sent every second by a separate thread: the process is alive, whatever its jobs do.
struct Heartbeat {
  std::uint64_t geometry_bytes = 0, image_bytes = 0;  ///< kept for later jobs
};
struct Progress {
  std::string job_id;
  std::uint64_t tiles_done = 0, tiles_total = 0;
};
/// Results of a measurement so far.
struct MeasurementUpdate {
  std::string job_id;
  std::string summary;  ///< as the report of Finished
};
struct PreviewResponse {
  std::string job_id;
  std::uint32_t side = 0;  ///< as requested
  std::string png;
};
/// Tasks of a divisible job; further ones follow in other messages.
struct PublishTasks {
  std::string job_id;
  std::vector<queue::NewTask> tasks;
};
/// Requests a task of the job for this worker. TaskTaken follows.
struct TakeTask {
  std::string job_id;
};
/// End of a task of TaskTaken or TraceTask.
struct TaskTraced {
  std::string job_id, key;
  bool failed = false;  ///< this worker cannot trace it; there is no result
  std::string result;   ///< at most task_bytes_max
};
struct ImageTaskResult {
  std::uint64_t number = 0;
  queue::ImageTaskResult result;
};
struct Image {
  std::string name;        ///< "image.png"
  std::string media_type;  ///< "image/png"
  Descriptor bytes;        ///< sealed memory
};
/// The files of a measurement.
struct FileType {
  const char* name;
  const char* media_type;
};
inline constexpr FileType measurement_files[] = {{"measure.json", "application/json"},
                                                 {"measure.csv", "text/csv"},
                                                 {"measure.svg", "image/svg+xml"},
                                                 {"measure.png", "image/png"},
                                                 {"reference.exr", "image/x-exr"}};
struct Finished {
  std::string job_id;
  std::int64_t fence = 0;
  std::string report;  ///< JSON text
  std::vector<Image> images;
  std::optional<api::ReportFigures> figures{};  ///< set by the receiver, from a valid report
};
struct Failed {
  std::string job_id;
  std::int64_t fence = 0;
  queue::Problem problem;
};
struct Cancelled {
  std::string job_id;
  std::int64_t fence = 0;
};

// ---- on the second socket

/// From the worker; the next FileResponse belongs to it.
struct FileRequest {
  std::string name;                ///< the file as the document names it
  bool content_name_only = false;  ///< see SceneFiles::content_name
};
struct FileResponse {
  std::string failure{};           ///< the daemon cannot open files now; empty: it can
  bool unavailable = false;        ///< the failure ends by itself: the store of uploads is away
  std::string refusal{};           ///< the reason why the file is not available
  std::string content_name{};      ///< if only that was requested
  std::vector<Descriptor> file{};  ///< otherwise the file, opened for reading; none if it was refused
};

/// Code of the problem of a job whose uploads cannot be fetched at present. It returns to the queue, and the attempt
/// does not count.
constexpr std::string_view assets_unavailable = "assets_unavailable";

/// Changes with the messages and the order of their fields (protocol.cpp).
constexpr std::uint32_t protocol_version = 10;

using Message =
    std::variant<Assign, Cancel, Ready, Heartbeat, Progress, Finished, Failed, Cancelled, PreviewRequest,
                 PreviewResponse, Configure, FileRequest, FileResponse, ImageTask, ImageTaskResult, MeasurementUpdate,
                 PublishTasks, TakeTask, TaskTraced, TraceTask, TaskTaken, TaskDone, Helpers>;

// ---- packets

/// Sealed anonymous memory (memfd_create(2)) with these bytes: large data passes between processes without a copy.
/// Throws std::system_error.
Descriptor sealed_memory(std::string_view bytes);
/// The same with the bytes of an image, in pieces. Throws std::runtime_error if it is shorter than before.
Descriptor sealed_memory(const queue::ArtifactReader& image);

/// True if no process can write, grow or shrink the memory any more, so that reading it is safe.
bool is_sealed(int fd);

/// A message that can be sent repeatedly.
struct Packet {
  std::string bytes;
  std::vector<Descriptor> files;
};
/// Throws std::system_error without memory for a large body or without descriptors.
Packet pack(Message message);

enum class Sent { yes, later, closed };
/// Sends one packet completely or not at all. `later`: a non-blocking socket is full. Any thread. Never throws.
Sent send(int socket, const Packet& packet);

/// The same, once there is space. Throws as pack.
void send_when_possible(int socket, Message message);

/// A non-blocking socket has no message now.
struct Nothing {};
/// The other end is closed.
struct Closed {};
/// The packet is no valid message; the other end is faulty and must not be trusted any more.
struct Malformed {
  std::string detail;
};
/// The message was dropped because this process has no free descriptors.
struct Lost {};
using Received = std::variant<Message, Nothing, Closed, Malformed, Lost>;

/// Descriptors beside a packet: sealed memory only, or any files, from the daemon.
enum class FileRule { sealed, any };

/// Reads one packet. Bodies above `body_limit` bytes are Malformed and not read. Every length is validated. Throws only
/// std::bad_alloc.
Received receive(int socket, std::size_t body_limit, FileRule rule = FileRule::sealed);

/// Reports and problems are small, and a part of an image or its result has at most 2^17 pixels.
constexpr std::size_t worker_body_limit = 48u << 20;
constexpr std::size_t task_bytes_max = 32u << 20;
/// The daemon has checked documents against its own limit; this one bounds an allocation.
constexpr std::size_t daemon_body_limit = 1u << 30;

/// The descriptor of the socket in the worker.
constexpr int worker_socket = 3;

}  // namespace worker
