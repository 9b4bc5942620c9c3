#include "api/cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <utility>

namespace cli {
namespace {

constexpr int bar_width = 40, bar_width_behind_label = 20;
constexpr const char* erase_line = "\r\x1b[K";

void draw(const tracer::RenderControl& control, const std::string& label, double seconds) {
  const double part = control.progress();
  const int width = label.empty() ? bar_width : bar_width_behind_label;
  const auto filled = static_cast<std::size_t>(width * part);
  const std::string bar = std::string(filled, '=') + std::string(width - filled, ' ');
  std::fprintf(stderr, "%s%s[%s] %3.0f %%", erase_line, label.c_str(), bar.c_str(), 100 * part);
  // Tiles differ in cost: an estimate from less than 5 % is unreliable.
  if (part >= 0.05) std::fprintf(stderr, "  %.0f s left", seconds * (1 - part) / part);
  std::fflush(stderr);
}

// A signal handler can use globals only. Set during the lifetime of a CancelOnSignal.
std::atomic<tracer::RenderControl*> cancelled_by_signal{nullptr};
static_assert(std::atomic<tracer::RenderControl*>::is_always_lock_free, "a signal handler must not lock");

void cancel(int /*signal*/) {
  if (tracer::RenderControl* control = cancelled_by_signal.load()) control->cancel();
}

}  // namespace

ProgressBar::ProgressBar(const tracer::RenderControl& control, bool enabled, std::string label)
    : control_(control), label_(label.empty() ? "" : std::move(label) + " ") {
  if (enabled && ::isatty(STDERR_FILENO) != 0)
    thread_ = std::jthread([this](const std::stop_token& stop) { draw_until(stop); });
}

ProgressBar::~ProgressBar() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
  std::fputs(erase_line, stderr);
}

void ProgressBar::draw_until(const std::stop_token& stop) const {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  while (!stopped.wait_for(lock, stop, std::chrono::milliseconds(100), [&] { return stop.stop_requested(); }))
    draw(control_, label_, std::chrono::duration<double>(Clock::now() - start).count());
}

CancelOnSignal::CancelOnSignal(tracer::RenderControl& control) {
  assert(cancelled_by_signal.load() == nullptr);
  cancelled_by_signal = &control;
  struct sigaction action {};
  action.sa_handler = cancel;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (std::size_t i = 0; i < signals.size(); ++i) {
    sigaction(signals[i], nullptr, &previous_[i]);
    if (previous_[i].sa_handler != SIG_IGN) sigaction(signals[i], &action, nullptr);
  }
}

CancelOnSignal::~CancelOnSignal() {
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &previous_[i], nullptr);
  cancelled_by_signal = nullptr;
}

}  // namespace cli
