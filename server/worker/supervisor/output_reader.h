#pragma once
/// Reads the standard output and error of a worker process, such as warnings of libraries and reports of sanitizers.
/// The text is untrusted, so its length and number of lines are limited before it is logged.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "server/support/descriptor.h"

namespace worker {

/// Used by one thread.
class OutputReader {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// Receives a line without its end, and the number of lines omitted since the last one.
  using OnLine = std::function<void(const std::string& text, std::uint64_t omitted_lines)>;

  static constexpr std::size_t line_bytes = 1024;  ///< longer lines are truncated
  /// The report of a sanitizer has 100 lines; a library that warns for each row of an image writes thousands.
  static constexpr int lines_per_period = 200;
  static constexpr std::chrono::seconds period{60};

  /// `pipe` is the reading end of a non-blocking pipe.
  explicit OutputReader(support::Descriptor pipe) : pipe_(std::move(pipe)) {}

  /// To be polled for POLLIN; -1 after the end of the pipe.
  [[nodiscard]] int descriptor() const { return pipe_.get(); }

  /// Reads the available output, at most two full pipes, and passes on complete lines; at the end of the pipe also the
  /// last one.
  void read(Time now, const OnLine& on_line);

 private:
  void add(std::string_view bytes, Time now, const OnLine& on_line);
  void end_line(Time now, const OnLine& on_line);

  support::Descriptor pipe_;
  std::string line_;  ///< beginning of the next line
  Time period_end_{};
  int left_in_period_ = 0;
  std::uint64_t omitted_lines_ = 0;
};

}  // namespace worker
