#pragma once
/// The bar a person watches while an image is traced, and the key that stops it.

#include <array>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <string>
#include <thread>

#include "tracer/control.h"

namespace cli {

/// Redraws one line of standard error ten times a second while it lives, and wipes it at the end. Draws nothing where
/// standard error is no terminal. `control` must outlive it.
class ProgressBar {
 public:
  ProgressBar(const tracer::RenderControl& control, bool wanted, std::string label = "");
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar();

 private:
  void draw_until_stopped();

  const tracer::RenderControl& control_;
  const std::string label_;  ///< in front of the bar
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopped_ = false;
  std::thread thread_;  // last: it uses all of the above
};

/// While it lives, the first SIGINT, SIGTERM or SIGHUP cancels `control`; the next one ends the process. Signals that
/// were ignored stay so (nohup). One at a time.
class CancelOnSignal {
 public:
  explicit CancelOnSignal(tracer::RenderControl& control);
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;
  ~CancelOnSignal();

 private:
  static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, signals.size()> before_{};
};

}  // namespace cli
