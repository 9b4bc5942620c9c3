#include "server/worker/supervisor/output_reader.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace worker {

void OutputReader::read(Time now, const OnLine& on_line) {
  constexpr int pieces_max = 32;  // 128 KiB, two full pipes: a flood must not delay the event loop
  std::array<char, 4096> piece{};
  for (int i = 0; i < pieces_max && pipe_; ++i) {
    const ssize_t got = ::read(pipe_.get(), piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EAGAIN) return;
    if (got > 0) {
      add({piece.data(), static_cast<std::size_t>(got)}, now, on_line);
    } else {
      pipe_.reset();
      end_line(now, on_line);
    }
  }
}

void OutputReader::add(std::string_view bytes, Time now, const OnLine& on_line) {
  while (!bytes.empty()) {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    line_.append(bytes.substr(0, std::min(end, line_bytes - line_.size())));
    if (end == bytes.size()) return;
    end_line(now, on_line);
    bytes.remove_prefix(end + 1);
  }
}

void OutputReader::end_line(Time now, const OnLine& on_line) {
  if (line_.empty()) return;
  if (now >= period_end_) {
    period_end_ = now + period;
    left_in_period_ = lines_per_period;
  }
  if (left_in_period_ > 0) {
    --left_in_period_;
    on_line(line_, std::exchange(omitted_lines_, 0));
  } else {
    ++omitted_lines_;
  }
  line_.clear();
}

}  // namespace worker
