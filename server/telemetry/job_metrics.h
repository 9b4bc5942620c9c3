#pragma once
/// What jobs come to, as figures: how long they waited and ran, how they ended, which rays they took, whether the
/// errors asked for were met.

#include <functional>
#include <optional>

#include "server/jobs/observer.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/render_pace.h"

namespace telemetry {

class JobMetrics final : public jobs::Observer {
 public:
  /// The job as it is stored; may throw: then this job is not counted. Called from any thread.
  using Find = std::function<std::optional<jobs::Job>(const std::string& id)>;

  /// `next` is told everything as well. All must outlive this.
  JobMetrics(Metrics& metrics, RenderPace& pace, Find find, jobs::Observer& next)
      : metrics_(metrics), pace_(pace), find_(std::move(find)), next_(next) {}

  void moved(const std::string& id, jobs::JobState to) noexcept override;
  void settled(const std::string& id) noexcept override;
  void progressed(const std::string& id, double fraction) noexcept override { next_.progressed(id, fraction); }
  void removed(const std::string& id) noexcept override { next_.removed(id); }

  /// Those that this adds to.
  static std::vector<Family> families();

 private:
  void count_end(const jobs::Job& job);

  Metrics& metrics_;
  RenderPace& pace_;
  const Find find_;
  jobs::Observer& next_;
};

}  // namespace telemetry
