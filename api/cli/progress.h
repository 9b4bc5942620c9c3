#pragma once
/// Progress bar on a terminal, and cancellation by signals.

#include <array>
#include <csignal>
#include <string>
#include <thread>

#include "tracer/control.h"

namespace cli {

/// Redraws one line of standard error ten times per second during its lifetime and erases it at the end. Draws nothing
/// if standard error is not a terminal. `control` must outlive it.
class ProgressBar {
 public:
  ProgressBar(const tracer::RenderControl& control, bool enabled, std::string label = "");
  ProgressBar(ProgressBar&&) = delete;
  ~ProgressBar();

 private:
  void draw_until(const std::stop_token& stop) const;

  const tracer::RenderControl& control_;
  const std::string label_;  ///< in front of the bar
  std::jthread thread_;      ///< last: it uses the other members
};

/// During its lifetime the first SIGINT, SIGTERM or SIGHUP cancels `control`; the next one terminates the process.
/// Ignored signals stay ignored (nohup). At most one instance at a time.
class CancelOnSignal {
 public:
  explicit CancelOnSignal(tracer::RenderControl& control);
  CancelOnSignal(CancelOnSignal&&) = delete;
  ~CancelOnSignal();

 private:
  static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, signals.size()> previous_{};
};

}  // namespace cli
