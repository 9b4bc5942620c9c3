#include "server/queue/events.h"

#include <algorithm>
#include <new>
#include <utility>

namespace queue {

/// A listener's queue. Everything of it is guarded by the hub's mutex.
class Events::Place final : public Listener {
 public:
  Place(Events& hub, std::string job_id, std::int64_t start, bool missed)
      : hub_(hub),
        job_id_(std::move(job_id)),
        start_(start),
        missed_(missed),
        untaken_max_(hub.settings_.untaken_max) {}
  ~Place() override { hub_.forget(this); }

  void on_news(std::function<void()> wake) override {
    const std::lock_guard lock(hub_.mutex_);
    wake_ = std::move(wake);
    if (!untaken_.empty() || over_) wake_();
  }

  Batch take(std::size_t bytes) override {
    const std::lock_guard lock(hub_.mutex_);
    Batch batch;
    while (!untaken_.empty() && (batch.text.empty() || batch.text.size() + untaken_.front()->text.size() <= bytes)) {
      batch.text += untaken_.front()->text;
      untaken_.pop_front();
    }
    batch.over = over_ && untaken_.empty();
    return batch;
  }

  [[nodiscard]] std::int64_t start() const override { return start_; }
  [[nodiscard]] bool missed() const override { return missed_; }
  [[nodiscard]] const std::string& job_id() const { return job_id_; }

  /// Under the hub's mutex: what it missed, which is not what it is too slow for.
  void push_missed(const std::shared_ptr<const Told>& told) {
    ++untaken_max_;
    push(told);
  }

  /// Under the hub's mutex.
  void push(const std::shared_ptr<const Told>& told) {
    if (over_) return;
    const bool news = untaken_.empty();
    const bool progress = told->event.kind == JobEvent::Kind::progress;
    if (progress && !news && untaken_.back()->event.kind == JobEvent::Kind::progress &&
        untaken_.back()->event.job_id == told->event.job_id) {
      untaken_.back() = told;  // the newer one says all
      return;
    }
    if (untaken_.size() >= untaken_max_) {
      untaken_.clear();
      over_ = true;
    } else {
      untaken_.push_back(told);
      over_ = !job_id_.empty() && told->event.kind == JobEvent::Kind::done;
    }
    if (news && wake_) wake_();
  }

 private:
  Events& hub_;
  const std::string job_id_;
  const std::int64_t start_;
  const bool missed_;
  std::size_t untaken_max_;
  std::function<void()> wake_;
  std::deque<std::shared_ptr<const Told>> untaken_;
  bool over_ = false;
};

Events::Events(Writer write, Clock clock, EventSettings settings)
    : write_(std::move(write)),
      clock_(std::move(clock)),
      settings_(settings),
      last_(clock_() * 1000),  // a thousand events a millisecond do not happen: numbers of earlier runs are smaller
      floor_(last_) {}

Events::~Events() = default;

void Events::on_state_changed(const std::string& id, JobState to) noexcept {
  const bool last = ended(to);
  tell({0, last ? JobEvent::Kind::done : JobEvent::Kind::state, id, name_of(to), to == JobState::succeeded ? 1.0 : 0.0,
        clock_()});
}

void Events::on_removed(const std::string& id) noexcept { tell({0, JobEvent::Kind::done, id, "removed", 0, clock_()}); }

void Events::on_progress(const std::string& id, double fraction) noexcept {
  const std::int64_t now = clock_();
  {
    const std::lock_guard lock(mutex_);
    if (of_all_.empty() && !of_job_.contains(id)) return;
    const auto told = progress_told_.find(id);
    if (told != progress_told_.end() && now - told->second < settings_.progress_interval.count()) return;
  }
  tell({0, JobEvent::Kind::progress, id, name_of(JobState::running), fraction, now});
}

/// Without memory an event is lost to everybody: its number is then missing, and those who come back look themselves.
void Events::tell(JobEvent event) noexcept {
  const std::lock_guard lock(mutex_);
  event.number = ++last_;
  try {
    const bool progress = event.kind == JobEvent::Kind::progress;
    if (progress) progress_told_.insert_or_assign(event.job_id, event.at);
    if (!progress) progress_told_.erase(event.job_id);
    auto told = std::make_shared<Told>();
    told->text = write_(event);
    told->event = std::move(event);
    if (!progress) moves_.push_back(told);
    if (moves_.size() > settings_.kept) {
      floor_ = moves_.front()->event.number;
      moves_.pop_front();
    }
    for (Place* place : of_all_) place->push(told);
    const auto [first, last] = of_job_.equal_range(told->event.job_id);
    for (auto entry = first; entry != last; ++entry) entry->second->push(told);
  } catch (const std::bad_alloc&) {
    floor_ = last_;
    moves_.clear();
  }
}

std::unique_ptr<Events::Listener> Events::listen(const std::string& job_id, std::optional<std::int64_t> after) {
  const std::lock_guard lock(mutex_);
  if (of_all_.size() + of_job_.size() >= settings_.listeners_max) return nullptr;
  const bool kept = after && *after >= floor_ && *after <= last_;
  auto place = std::make_unique<Place>(*this, job_id, kept ? *after : last_, after && !kept);
  if (job_id.empty()) {
    of_all_.insert(place.get());
  } else {
    of_job_.emplace(job_id, place.get());
  }
  if (kept) {
    const auto first =
        std::upper_bound(moves_.begin(), moves_.end(), *after,
                         [](std::int64_t number, const auto& told) { return number < told->event.number; });
    for (auto told = first; told != moves_.end(); ++told) {
      if (job_id.empty() || (*told)->event.job_id == job_id) place->push_missed(*told);
    }
  }
  return place;
}

void Events::forget(Place* place) {
  const std::lock_guard lock(mutex_);
  of_all_.erase(place);
  const auto [first, last] = of_job_.equal_range(place->job_id());
  const auto entry = std::find_if(first, last, [&](const auto& candidate) { return candidate.second == place; });
  if (entry != last) of_job_.erase(entry);
}

bool Events::ended_by(const std::string& job_id, std::int64_t number) const {
  const std::lock_guard lock(mutex_);
  if (number > last_) return false;  // no number of ours
  return std::any_of(moves_.begin(), moves_.end(), [&](const auto& told) {
    return told->event.number <= number && told->event.kind == JobEvent::Kind::done && told->event.job_id == job_id;
  });
}

std::int64_t Events::latest() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

std::size_t Events::listeners() const {
  const std::lock_guard lock(mutex_);
  return of_all_.size() + of_job_.size();
}

}  // namespace queue
