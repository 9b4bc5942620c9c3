/// fake_worker: uses the protocol of the worker and executes each document as a script, one command a line:
///
///   finish TEXT         answers Finished with TEXT as image and in the report (also for an empty document)
///   finish_and_crash TEXT   the same, and dies of SIGSEGV at once
///   fail CODE           answers Failed
///   progress DONE TOTAL
///   wait FILE           waits until FILE exists, or stops after a Cancel
///   hang FILE           waits until FILE exists and ignores Cancel
///   show MS FILE        answers a Cancel with a preview after so many milliseconds, then hangs
///   crash               dies of SIGSEGV
///   exit STATUS
///   crash_unless FILE   dies of SIGSEGV unless FILE exists; creates it first
///   fail_unless FILE CODE   answers Failed unless FILE exists; creates it first
///   fill BYTES FILE     allocates memory, and waits as wait FILE
///   garbage             sends bytes that are not a message
///   stale               sends a Finished with the fence before this one
///   print COUNT TEXT    writes that many numbered lines to its standard error
///   badname             sends an image whose name contains a line break
///   descriptors         sends a message with more descriptors than any has
///
/// An image task gets the result "image". One of the kind "unless FILE" gets none unless FILE exists, and creates it.
///
/// While the file that FAKE_WORKER_HANGS names exists, a new process hangs before it is ready.

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "server/queue/job_waiters.h"
#include "server/worker/protocol/protocol.h"

using namespace worker;

namespace {

void send_message(Message message) {
  const Packet packet = pack(std::move(message));
  while (send(worker_socket, packet) == Sent::later) std::this_thread::yield();
}

void send_raw(const std::string& bytes) { (void)!::send(worker_socket, bytes.data(), bytes.size(), MSG_NOSIGNAL); }

/// Without the limit of worker::send.
void send_with_descriptors(std::string bytes, std::size_t count) {
  const Descriptor file = sealed_memory("x");
  const std::vector<int> files(count, file.get());
  iovec data{bytes.data(), bytes.size()};
  std::vector<char> control(CMSG_SPACE(count * sizeof(int)));
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(count * sizeof(int));
  std::memcpy(CMSG_DATA(rights), files.data(), count * sizeof(int));
  (void)!sendmsg(worker_socket, &message, MSG_NOSIGNAL);
}

bool exists(const std::string& path) { return access(path.c_str(), F_OK) == 0; }

void crash() {
  std::signal(SIGSEGV, SIG_DFL);  // without the report of a sanitizer
  raise(SIGSEGV);
}

std::vector<Image> one_image(const std::string& name, const std::string& bytes) {
  std::vector<Image> images;
  images.push_back({name, "image/png", sealed_memory(bytes)});
  return images;
}

/// False after the answer of the job.
bool execute(const std::string& line, const Assign& job, const std::atomic<bool>& cancelled) {
  std::istringstream words(line);
  std::string command, argument;
  words >> command;
  std::getline(words >> std::ws, argument);
  std::istringstream arguments(argument);
  const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(1)); };
  if (command == "finish" || command == "finish_and_crash") {
    const std::string report = R"({"text":")" + argument + R"("})";
    send_message(Finished{job.job_id, job.fence, report, one_image("image.png", argument)});
    if (command == "finish_and_crash") crash();
    return false;
  }
  if (command == "fail") {
    send_message(Failed{job.job_id, job.fence, {argument, "As the document requires.", {{"/a", "b", "c"}}}});
    return false;
  }
  if (command == "progress") {
    Progress progress{job.job_id, 0, 0};
    arguments >> progress.tiles_done >> progress.tiles_total;
    send_message(progress);
  }
  if (command == "wait" || command == "hang") {
    while (!exists(argument) && (command == "hang" || !cancelled)) pause();
    if (command == "wait" && cancelled) {
      send_message(Cancelled{job.job_id, job.fence});
      return false;
    }
  }
  if (command == "show") {
    int ms = 0;
    std::string file;
    arguments >> ms >> file;
    while (!cancelled) pause();
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    send_message(PreviewResponse{job.job_id, queue::last_preview_side, "the last preview"});
    return execute("hang " + file, job, cancelled);
  }
  if (command == "crash") crash();
  if (command == "exit") _exit(std::stoi(argument));
  if (command == "crash_unless" && !exists(argument)) {
    std::ofstream(argument) << "crashed";
    crash();
  }
  if (command == "fail_unless") {
    std::string file, code;
    arguments >> file >> code;
    if (!exists(file)) {
      std::ofstream(file) << "failed";
      return execute("fail " + code, job, cancelled);
    }
  }
  if (command == "fill") {
    std::size_t bytes = 0;
    std::string file;
    arguments >> bytes >> file;
    const std::vector<char> memory(bytes, 'x');
    return execute("wait " + file, job, cancelled);
  }
  if (command == "garbage") send_raw("this is not a message, and long enough to have a header");
  if (command == "badname") send_message(Finished{job.job_id, job.fence, "{}", one_image("a\r\nSet-Cookie: b", "x")});
  if (command == "descriptors") send_with_descriptors(pack(Heartbeat{}).bytes, 17);
  if (command == "print") {
    int count = 0;
    std::string text;
    std::getline(arguments >> count >> std::ws, text);
    for (int i = 0; i < count; ++i) std::fprintf(stderr, "%d %s\n", i, text.c_str());
  }
  if (command == "stale") send_message(Finished{job.job_id, job.fence - 1, "{}", one_image("image.png", "x")});
  return true;
}

void run(const Assign& job, const std::shared_ptr<std::atomic<bool>>& cancelled) {
  std::istringstream lines(job.document);
  for (std::string line; std::getline(lines, line);) {
    if (!execute(line, job, *cancelled)) return;
  }
  execute("finish nothing", job, *cancelled);
}

void run(const ImageTask& task) {
  std::istringstream words(task.work.kind);
  std::string command, file;
  words >> command >> file;
  if (command == "unless" && !exists(file)) {
    std::ofstream(file) << "received";
    return;
  }
  send_message(ImageTaskResult{task.number, {{}, "image"}});
}

}  // namespace

int main() {
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  const char* const hangs = std::getenv("FAKE_WORKER_HANGS");
  while (hangs != nullptr && exists(hangs)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  send_message(Ready{"fake"});
  std::thread([] {
    while (true) {
      send_message(Heartbeat{});
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }).detach();

  std::map<std::string, std::shared_ptr<std::atomic<bool>>> cancelled;
  for (;;) {
    Received received = receive(worker_socket, daemon_body_limit, FileRule::any);
    auto* message = std::get_if<Message>(&received);
    if (message == nullptr) _exit(0);
    if (auto* job = std::get_if<Assign>(message)) {
      const auto flag = cancelled[job->job_id] = std::make_shared<std::atomic<bool>>(false);
      std::thread([assigned = std::make_shared<Assign>(std::move(*job)), flag] { run(*assigned, flag); }).detach();
    }
    if (const auto* task = std::get_if<ImageTask>(message)) run(*task);
    if (auto* cancel = std::get_if<Cancel>(message)) {
      if (cancelled.contains(cancel->job_id)) *cancelled[cancel->job_id] = true;
    }
  }
}
