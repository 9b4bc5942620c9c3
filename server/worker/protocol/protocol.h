#pragma once
/// What daemon and worker say to each other, and how it becomes packets on a socket pair and back.
///
/// A packet is one message (SOCK_SEQPACKET keeps them apart): a header with the protocol's version, the kind of message
/// and the body's size, then the body; a body that is larger than a few KiB travels in sealed memory beside the packet
/// (SCM_RIGHTS), as images do. Byte order and sizes are the machine's: both ends come from one build.
///
/// The worker says Hello once it can render. Then the daemon assigns jobs, never more at once than the worker has
/// slots; the worker answers each with exactly one of Finished, Failed, Cancelled. There is no goodbye: a worker whose
/// socket is at its end, because the daemon died, ends at once.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/queue/job.h"
#include "server/worker/protocol/sealed_memory.h"

namespace worker {

// ---- daemon to worker

struct Assign {
  std::string job_id;
  std::int64_t fence = 0;  ///< comes back with the answer
  double queue_ms = 0;     ///< how long the job waited, for its report
  std::string document;
  std::string kind{"render"};  ///< a queue::JobKind's name
  bool large = false;          ///< see queue::Job
};
/// Cancelled follows soon, or Finished or Failed when the worker was faster. Unknown jobs are ignored.
struct Cancel {
  std::string job_id;
};
/// Somebody wants to see how far an image is. Looked follows once there is something to see, unless the job ends
/// first. Unknown jobs are ignored.
struct Look {
  std::string job_id;
  std::uint32_t side = 0;  ///< pixels along the longer side, at most queue::preview_side_max
};

// ---- worker to daemon

struct Hello {
  std::string build;      ///< tracer::build()
  std::string sandbox{};  ///< what enter_sandbox returned
};
/// From a thread of its own, every second: the process is alive, whatever its jobs do.
struct Heartbeat {
  std::uint64_t geometry_bytes = 0, image_bytes = 0;  ///< kept for later jobs
};
struct Progress {
  std::string job_id;
  std::uint64_t tiles_done = 0, tiles_total = 0;
};
struct Looked {
  std::string job_id;
  std::uint32_t side = 0;  ///< as asked for
  std::string png;
};
struct Image {
  std::string name;        ///< "image.png"
  std::string media_type;  ///< "image/png"
  Descriptor bytes;        ///< sealed memory
};
struct Finished {
  std::string job_id;
  std::int64_t fence = 0;
  std::string report;  ///< JSON text
  std::vector<Image> images;
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

using Message = std::variant<Assign, Cancel, Hello, Heartbeat, Progress, Finished, Failed, Cancelled, Look, Looked>;

// ---- packets

/// A message ready to be sent, as often as it takes.
struct Packet {
  std::string bytes;
  std::vector<Descriptor> files;
};
/// Throws std::system_error when memory for a large body or a descriptor cannot be had.
Packet pack(Message message);

enum class Sent { yes, later, closed };
/// One packet, whole or not at all. `later`: a non-blocking socket is full. Any thread. Never throws.
Sent send(int socket, const Packet& packet);

/// Nothing to read now, on a non-blocking socket.
struct Nothing {};
/// The other end is gone.
struct Closed {};
/// What came is no message: the other end is broken and cannot be trusted further.
struct Malformed {
  std::string detail;
};
/// The message is gone, because this process could not take its descriptors: it has no more to give.
struct Lost {};
using Received = std::variant<Message, Nothing, Closed, Malformed, Lost>;

/// Reads one packet. Bodies above `body_limit` bytes are Malformed, unread. Every length is checked before it is
/// believed, every descriptor must be sealed memory. Throws std::bad_alloc at most.
Received receive(int socket, std::size_t body_limit);

/// A worker's report and problem are small; more is a worker gone mad.
constexpr std::size_t worker_body_limit = 16u << 20;
/// The daemon has checked its documents against its own limit; this one only keeps a size from being nonsense.
constexpr std::size_t daemon_body_limit = 1u << 30;

/// The worker finds its socket here.
constexpr int worker_socket = 3;

}  // namespace worker
