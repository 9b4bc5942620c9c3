#include "server/worker/protocol/protocol.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "server/support/file_io.h"

namespace worker {
namespace {

// ---- serialization: a message is its fields in order. A string is its length and its bytes, a list its length and its
// elements; a descriptor is only a position among the files beside the packet.

// The order of the fields in a packet. A change requires a new protocol_version.
auto fields(FileSettings& m) { return std::tie(m.directory, m.uploads, m.objects, m.triangles); }
auto fields(Options& m) {
  return std::tie(m.slots, m.threads, m.job_memory_bytes, m.scene_cache_bytes, m.cache_idle_ms, m.files);
}
auto fields(Configure& m) { return std::tie(m.options, m.file_socket); }
auto fields(Assign& m) {
  return std::tie(m.job_id, m.fence, m.queue_ms, m.document, m.kind, m.large, m.divisible, m.resumes);
}
auto fields(Cancel& m) { return std::tie(m.job_id, m.preview); }
auto fields(MeasurementUpdate& m) { return std::tie(m.job_id, m.summary); }
auto fields(queue::ImageWork& m) {
  return std::tie(m.kind, m.side, m.tolerance, m.heat, m.layer, m.exposure, m.range, m.crop, m.document);
}
auto fields(queue::ImageTaskResult& m) { return std::tie(m.failure, m.bytes, m.text, m.code); }
auto fields(ImageTask& m) { return std::tie(m.number, m.work, m.images); }
auto fields(ImageTaskResult& m) { return std::tie(m.number, m.result); }
auto fields(queue::NewTask& m) { return std::tie(m.key, m.part); }
auto fields(PublishTasks& m) { return std::tie(m.job_id, m.tasks); }
auto fields(TakeTask& m) { return std::tie(m.job_id); }
auto fields(TaskTraced& m) { return std::tie(m.job_id, m.key, m.failed, m.result); }
auto fields(TraceTask& m) { return std::tie(m.job_id, m.key, m.document, m.part); }
auto fields(TaskTaken& m) { return std::tie(m.job_id, m.key, m.attempt); }
auto fields(TaskDone& m) { return std::tie(m.job_id, m.key, m.node, m.attempt, m.result); }
auto fields(Helpers& m) { return std::tie(m.count); }
auto fields(Ready& m) { return std::tie(m.build, m.sandbox); }
auto fields(Heartbeat& m) { return std::tie(m.geometry_bytes, m.image_bytes); }
auto fields(Progress& m) { return std::tie(m.job_id, m.tiles_done, m.tiles_total); }
auto fields(PreviewRequest& m) { return std::tie(m.job_id, m.side); }
auto fields(PreviewResponse& m) { return std::tie(m.job_id, m.side, m.png); }
auto fields(Image& m) { return std::tie(m.name, m.media_type, m.bytes); }
auto fields(Finished& m) { return std::tie(m.job_id, m.fence, m.report, m.images); }
auto fields(Failed& m) { return std::tie(m.job_id, m.fence, m.problem); }
auto fields(Cancelled& m) { return std::tie(m.job_id, m.fence); }
auto fields(FileRequest& m) { return std::tie(m.name, m.content_name_only); }
auto fields(FileResponse& m) { return std::tie(m.failure, m.unavailable, m.refusal, m.content_name, m.file); }
auto fields(queue::Problem& m) { return std::tie(m.code, m.detail, m.errors); }
auto fields(tracer::Issue& m) { return std::tie(m.pointer, m.code, m.detail); }

class MessageWriter {
 public:
  template <class T>
  void write(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    } else {
      std::apply([&](auto&... field) { (write(field), ...); }, fields(value));
    }
  }
  void write(std::string& text) {
    write_size(text.size());
    bytes_ += text;
  }
  template <class T>
  void write(std::vector<T>& list) {
    write_size(list.size());
    for (T& element : list) write(element);
  }
  void write(Descriptor& file) { files_.push_back(std::move(file)); }

  std::string take_bytes() { return std::move(bytes_); }
  std::vector<Descriptor> take_files() { return std::move(files_); }

 private:
  void write_size(std::uint64_t size) { write(size); }
  std::string bytes_;
  std::vector<Descriptor> files_;
};

/// Validates untrusted bytes: every read returns false if it is impossible.
class MessageReader {
 public:
  MessageReader(std::string_view bytes, std::vector<Descriptor> files) : bytes_(bytes), files_(std::move(files)) {}

  template <class T>
  [[nodiscard]] bool read(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      if (bytes_.size() < sizeof value) return false;
      std::memcpy(&value, bytes_.data(), sizeof value);
      bytes_.remove_prefix(sizeof value);
      return true;
    } else {
      return std::apply([&](auto&... field) { return (read(field) && ...); }, fields(value));
    }
  }
  [[nodiscard]] bool read(bool& value) {
    std::uint8_t byte = 0;
    if (!read(byte) || byte > 1) return false;
    value = byte == 1;
    return true;
  }
  [[nodiscard]] bool read(std::string& text) {
    std::uint64_t size = 0;
    if (!read(size) || size > bytes_.size()) return false;
    text = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return true;
  }
  template <class T>
  [[nodiscard]] bool read(std::vector<T>& list) {
    std::uint64_t size = 0;
    // An element takes a descriptor or at least one byte.
    if (!read(size) || size > (std::is_same_v<T, Descriptor> ? files_.size() : bytes_.size())) return false;
    for (std::uint64_t i = 0; i < size; ++i) {
      if (!read(list.emplace_back())) return false;
    }
    return true;
  }
  [[nodiscard]] bool read(Descriptor& file) {
    if (next_file_ == files_.size()) return false;
    file = std::move(files_[next_file_++]);
    return true;
  }
  [[nodiscard]] bool at_end() const { return bytes_.empty() && next_file_ == files_.size(); }

 private:
  std::string_view bytes_;
  std::vector<Descriptor> files_;
  std::size_t next_file_ = 0;
};

// ---- packets

/// Larger bodies travel beside the packet. The buffer of the socket (about 200 KiB) holds a packet for each slot.
constexpr std::size_t inline_body_limit = 4096;
constexpr std::size_t files_limit = 16;  ///< every output format at once, and the body

struct Header {
  std::uint32_t version = protocol_version;
  std::uint32_t kind = 0;  ///< index in Message
  std::uint64_t body_size = 0;
};

// ---- receiving

struct RawPacket {
  std::array<char, sizeof(Header) + inline_body_limit> bytes;
  std::size_t size = 0;
  std::vector<Descriptor> files;
};

std::vector<Descriptor> take_files(msghdr& message) {
  std::vector<Descriptor> files;
  for (cmsghdr* control = CMSG_FIRSTHDR(&message); control != nullptr; control = CMSG_NXTHDR(&message, control)) {
    if (control->cmsg_level != SOL_SOCKET || control->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (control->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int fd = -1;
      std::memcpy(&fd, CMSG_DATA(control) + i * sizeof fd, sizeof fd);
      files.emplace_back(fd);
    }
  }
  return files;
}

std::optional<std::string> read_body(int memory, std::size_t size) {
  std::string body(size, '\0');
  if (support::read_at(memory, 0, body.data(), size) != static_cast<ssize_t>(size)) return std::nullopt;
  return body;
}

template <std::size_t... Kinds>
bool read_message(std::uint32_t kind, MessageReader& reader, Message& message, std::index_sequence<Kinds...>) {
  return ((kind == Kinds && reader.read(message.emplace<Kinds>())) || ...);
}

Received decode(std::uint32_t kind, std::string_view body, std::vector<Descriptor> files) {
  MessageReader reader(body, std::move(files));
  Message message;
  if (!read_message(kind, reader, message, std::make_index_sequence<std::variant_size_v<Message>>{}) ||
      !reader.at_end()) {
    return Malformed{"a message of kind " + std::to_string(kind) + " with an invalid body"};
  }
  return message;
}

Received decode(RawPacket packet, std::size_t body_limit, FileRule rule) {
  Header header;
  if (packet.size < sizeof header) return Malformed{"a packet without a header"};
  std::memcpy(&header, packet.bytes.data(), sizeof header);
  if (header.version != protocol_version) {
    return Malformed{"a packet of protocol version " + std::to_string(header.version) + " instead of " +
                     std::to_string(protocol_version)};
  }
  if (header.body_size > body_limit) return Malformed{"a body of " + std::to_string(header.body_size) + " bytes"};
  for (const Descriptor& file : packet.files) {
    if (rule == FileRule::sealed && !is_sealed(file.get())) return Malformed{"a descriptor that is not sealed memory"};
  }
  const std::string_view body(packet.bytes.data() + sizeof header, packet.size - sizeof header);
  if (header.body_size <= inline_body_limit) {
    if (body.size() != header.body_size) return Malformed{"a packet of the wrong size"};
    return decode(header.kind, body, std::move(packet.files));
  }
  if (!body.empty() || packet.files.empty() ||
      lseek(packet.files.front().get(), 0, SEEK_END) != static_cast<off_t>(header.body_size)) {
    return Malformed{"a large body without its memory"};
  }
  const std::optional<std::string> large = read_body(packet.files.front().get(), header.body_size);
  if (!large) return Malformed{"a large body that cannot be read"};
  packet.files.erase(packet.files.begin());
  return decode(header.kind, *large, std::move(packet.files));
}

Descriptor open_memory() {
  Descriptor memory(memfd_create("whittle", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory) throw std::system_error(errno, std::generic_category(), "memfd_create");
  return memory;
}

void append(const Descriptor& memory, std::string_view bytes) {
  if (!support::write_all(memory.get(), bytes))
    throw std::system_error(errno, std::generic_category(), "write to memory");
}

void seal(const Descriptor& memory) {
  if (fcntl(memory.get(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) != 0)
    throw std::system_error(errno, std::generic_category(), "seal memory");
}

}  // namespace

Descriptor sealed_memory(std::string_view bytes) {
  Descriptor memory = open_memory();
  append(memory, bytes);
  seal(memory);
  return memory;
}

Descriptor sealed_memory(const queue::ArtifactReader& image) {
  Descriptor memory = open_memory();
  std::string piece(std::min<std::uint64_t>(image.size_bytes(), 1u << 20), '\0');
  for (std::uint64_t done = 0; done < image.size_bytes();) {
    const std::size_t count = image.read(done, piece.data(), piece.size());
    if (count == 0) throw std::runtime_error("an image is shorter than before");
    append(memory, {piece.data(), count});
    done += count;
  }
  seal(memory);
  return memory;
}

bool is_sealed(int fd) {
  constexpr int wanted = F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK;
  const int seals = fcntl(fd, F_GET_SEALS);
  return seals >= 0 && (seals & wanted) == wanted;
}

Packet pack(Message message) {
  MessageWriter writer;
  std::visit([&](auto& kind) { writer.write(kind); }, message);
  Packet packet{{}, writer.take_files()};
  const std::string body = writer.take_bytes();
  const Header header{protocol_version, static_cast<std::uint32_t>(message.index()), body.size()};
  packet.bytes.assign(reinterpret_cast<const char*>(&header), sizeof header);
  if (body.size() <= inline_body_limit) {
    packet.bytes += body;
  } else {
    packet.files.insert(packet.files.begin(), sealed_memory(body));
  }
  return packet;
}

Sent send(int socket, const Packet& packet) {
  iovec bytes{const_cast<char*>(packet.bytes.data()), packet.bytes.size()};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(files_limit * sizeof(int))> control{};
  if (packet.files.size() > files_limit) return Sent::closed;
  if (!packet.files.empty()) {
    message.msg_control = control.data();
    message.msg_controllen = CMSG_SPACE(packet.files.size() * sizeof(int));
    cmsghdr* rights = CMSG_FIRSTHDR(&message);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(packet.files.size() * sizeof(int));
    for (std::size_t i = 0; i < packet.files.size(); ++i) {
      const int fd = packet.files[i].get();
      std::memcpy(CMSG_DATA(rights) + i * sizeof fd, &fd, sizeof fd);
    }
  }
  for (;;) {
    if (sendmsg(socket, &message, MSG_NOSIGNAL) >= 0) return Sent::yes;
    if (errno == EAGAIN || errno == ENOBUFS || errno == ENOMEM || errno == ETOOMANYREFS) return Sent::later;
    if (errno != EINTR) return Sent::closed;
  }
}

void send_when_possible(int socket, Message message) {
  const Packet packet = pack(std::move(message));
  while (send(socket, packet) == Sent::later) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

Received receive(int socket, std::size_t body_limit, FileRule rule) {
  RawPacket packet;
  iovec bytes{packet.bytes.data(), packet.bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(files_limit * sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t size = 0;
  do {
    size = recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  } while (size < 0 && errno == EINTR);
  if (size < 0 && (errno == EAGAIN || errno == ENOMEM)) return Nothing{};
  if (size <= 0) return Closed{};
  packet.size = static_cast<std::size_t>(size);
  packet.files = take_files(message);
  if ((message.msg_flags & MSG_TRUNC) != 0) return Malformed{"a packet that is too large"};
  if ((message.msg_flags & MSG_CTRUNC) != 0 && packet.files.size() == files_limit)
    return Malformed{"more than " + std::to_string(files_limit) + " descriptors"};
  if ((message.msg_flags & MSG_CTRUNC) != 0) return Lost{};
  return decode(std::move(packet), body_limit, rule);
}

}  // namespace worker
