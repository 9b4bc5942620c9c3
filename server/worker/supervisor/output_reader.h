#pragma once
/// What a worker process says on its standard output and error: libraries' words on broken files, an assertion's last
/// ones, a sanitizer's report. None of it is ours, so it is cut and counted before it comes into anybody's log.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "server/worker/protocol/sealed_memory.h"

namespace worker {

/// The lines that come out of a pipe, within bounds. Used by one thread.
class OutputReader {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// One line without its end, and how many before it were left out since the last.
  using Take = std::function<void(const std::string& text, std::uint64_t left_out)>;

  /// What is longer is cut: a path or a number is still in it.
  static constexpr std::size_t line_bytes = 1024;
  /// A sanitizer's report has 100 lines; a library that complains of each of an image's rows has thousands.
  static constexpr int lines_per_period = 200;
  static constexpr std::chrono::seconds period{60};

  /// Takes over the reading end of a pipe, which must not block.
  explicit OutputReader(Descriptor pipe) : pipe_(std::move(pipe)) {}

  /// To be polled for POLLIN; -1 when the pipe is at its end.
  [[nodiscard]] int descriptor() const { return pipe_.get(); }

  /// Reads what is there now, at most two pipes full, and gives on the lines that are complete; at the pipe's end
  /// also the last, whatever it lacks.
  void read(Time now, const Take& take);

 private:
  void add(std::string_view bytes, Time now, const Take& take);
  void end_line(Time now, const Take& take);

  Descriptor pipe_;
  std::string line_;  ///< what came of the next one, cut
  Time period_end_{};
  int left_in_period_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace worker
