#include "server/queue/node_link.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "server/support/text_values.h"

namespace queue {
namespace {

using Time = std::chrono::steady_clock::time_point;

constexpr int events_at_once = 1000;
constexpr std::chrono::milliseconds pause_between_tries{250};
/// A node that runs jobs starts with suspects, which need it alone, only when no idle one has taken them meanwhile.
constexpr int steps_until_suspects = 5;
constexpr int pause_ms_max = 200;

// Topics beside those of the runners. The id of progress is that of the job and the fraction after a blank.
constexpr std::string_view new_events = "events", progress_made = "progress", preview_made = "preview_made";

/// A job and a number of it.
template <class Number>
struct JobValue {
  std::string id;
  Number value;
};

template <class Number>
std::optional<JobValue<Number>> parse(const std::string& text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string::npos) return std::nullopt;
  const auto value = support::parse_number<Number>(std::string_view(text).substr(blank + 1));
  return value ? std::optional(JobValue<Number>{text.substr(0, blank), *value}) : std::nullopt;
}

std::string result_name(std::uint32_t side) { return "preview " + std::to_string(side); }

}  // namespace

NodeLink::NodeLink(Queue& queue, Events& events, ClusterStore& store, Wakeups& wakeups, Log log)
    : queue_(queue), events_(events), store_(store), wakeups_(wakeups), log_(std::move(log)) {
  queue_.connect(wakeups_, store_);
  store_.number_events();
  read_to_ = store_.event_range().first - 1;
  events_.continue_from(read_to_, [this] { read_events(); });
  read_events();
}

NodeLink::~NodeLink() { stop(); }

void NodeLink::stop() noexcept {
  subscriptions_.clear();
  change([this] { stopping_ = true; });
  if (thread_.joinable()) thread_.join();
}

void NodeLink::start(NodeLinkSettings settings) {
  settings_ = std::move(settings);
  subscribe();
  thread_ = std::thread([this] { run(); });
}

void NodeLink::leave() noexcept {
  stop();
  try {
    if (number_events()) wakeups_.publish(new_events, "new");
    store_.remove_node(settings_.node.id);
  } catch (const std::exception& failure) {
    log_(LogLevel::warning, "store_failure", {{"during", "leave"}, {"detail", failure.what()}});
  }
}

/// Called from the thread of the messages, so the work is left to that of this object.
void NodeLink::subscribe() {
  const auto on = [this](std::string_view topic, Wakeups::Receive receive) {
    subscriptions_.push_back(wakeups_.subscribe(std::string(topic), std::move(receive)));
  };
  on(topics::job_available,
     [this](const std::string&) { queue_.runner.call([](JobRunner& runner) { runner.notify(false); }); });
  on(topics::cancel, [this](const std::string& id) {
    if (!id.empty()) queue_.runner.call([&](JobRunner& runner) { runner.cancel(id); });
  });
  on(topics::preview, [this](const std::string& id_and_side) { answer_preview(id_and_side); });
  if (!settings_.has_clients) return;
  on(new_events, [this](const std::string&) { change([this] { has_events_ = true; }); });
  on(preview_made, [this](const std::string& id_and_side) { fetch_preview(id_and_side); });
  on(progress_made, [this](const std::string& id_and_fraction) {
    const auto progress = parse<double>(id_and_fraction);
    if (!progress) return;
    post([this, progress = *progress] {
      queue_.notifications.on_progress_elsewhere(progress.id, progress.value);
      events_.on_progress(progress.id, progress.value);
    });
  });
}

// ---- the thread

void NodeLink::run() {
  Time next{};
  bool failing = false;
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    changed_.wait_until(lock, next, [&] { return stopping_ || has_changes_ || has_events_ || !tasks_.empty(); });
    if (stopping_) return;
    const Time now = std::chrono::steady_clock::now();
    const bool is_due = now >= next;
    const bool has_changes = std::exchange(has_changes_, false), has_events = std::exchange(has_events_, false);
    if (is_due) next = now + settings_.interval;
    lock.unlock();
    try {
      step(has_changes, has_events, is_due);
      failing = false;
      lock.lock();
      if (has_changes) changed_.wait_for(lock, pause_, [&] { return stopping_; });
    } catch (const std::exception& failure) {
      if (!failing) log_(LogLevel::error, "store_failure", {{"during", "nodes"}, {"detail", failure.what()}});
      failing = true;
      lock.lock();
      has_changes_ = true;
      changed_.wait_for(lock, pause_between_tries, [&] { return stopping_; });
    }
  }
}

void NodeLink::step(bool has_changes, bool has_events, bool is_due) {
  const bool is_new = (has_changes || is_due) && number_events();
  if (is_new) wakeups_.publish(new_events, "new");
  if (settings_.has_clients && (is_new || has_events || is_due)) read_events();
  const auto tasks = support::locked(mutex_, [&] { return std::exchange(tasks_, {}); });
  for (const auto& task : tasks) task();
  if (!is_due) return;
  send_progress();
  report();
}

/// True if there are new ones. All nodes together call the store about once a millisecond at most.
bool NodeLink::number_events() {
  const std::optional<int> count = store_.number_events();
  if (!count) wake();  // the changes of this node may have been too late for the caller that numbers now
  return count.value_or(0) > 0;
}

void NodeLink::report() {
  Node node = settings_.node;
  std::tie(node.slots, node.running) = settings_.load();
  const ClusterStore::Duties duties = store_.report_node(node);
  queue_.set_nodes(duties.nodes);
  pause_ = std::chrono::milliseconds(std::clamp(duties.nodes, 1, pause_ms_max));
  steps_with_suspects_ = duties.suspects_wait ? steps_with_suspects_ + 1 : 0;
  const bool takes_suspects =
      duties.suspects_wait && (node.running == 0 || steps_with_suspects_ > steps_until_suspects);
  queue_.runner.call([&](JobRunner& runner) {
    runner.notify(takes_suspects);  // also where a message about a job was lost
    for (const std::string& id : duties.cancelled) runner.cancel(id);
  });
}

void NodeLink::send_progress() {
  const auto progress = support::locked(mutex_, [&] { return std::exchange(progress_, {}); });
  for (const auto& [id, fraction] : progress) wakeups_.publish(progress_made, id + " " + std::to_string(fraction));
}

void NodeLink::read_events() {
  const std::lock_guard lock(read_mutex_);
  std::vector<JobEvent> events;
  do {
    events = store_.events_after(read_to_, events_at_once);
    if (!events.empty() && events.front().number != read_to_ + 1) {  // this node was away for long
      events_.continue_from(events.front().number - 1, [this] { read_events(); });
      queue_.waiters.wake_all();
    }
    for (const JobEvent& event : events) {
      events_.add(event);
      if (event.kind == JobEvent::Kind::done) queue_.notifications.on_ended(event.job.id);
      read_to_ = event.number;
    }
  } while (events.size() == events_at_once);
}

// ---- changes of this node

void NodeLink::on_progress(const std::string& id, double fraction) noexcept {
  if (settings_.has_clients) events_.on_progress(id, fraction);
  const std::lock_guard lock(mutex_);
  progress_.insert_or_assign(id, fraction);
}

void NodeLink::on_measurement(const std::string& id, const std::string& summary) noexcept {
  post([this, id, summary] { store_.put_result(id, measurement_result, summary); });
}

// ---- previews of jobs that another node runs

void NodeLink::answer_preview(const std::string& id_and_side) {
  const auto request = parse<std::uint32_t>(id_and_side);
  if (!request) return;
  const auto store = [this, request = *request] {
    const Previews::Png png = queue_.waiters.preview(request.id, request.value).png;
    if (!png) return;
    store_.put_result(request.id, result_name(request.value), *png);
    wakeups_.publish(preview_made, request.id + " " + std::to_string(request.value));
  };
  queue_.waiters.request_own_preview(request->id, request->value, [this, store] { post(store); });
}

void NodeLink::fetch_preview(const std::string& id_and_side) {
  const auto made = parse<std::uint32_t>(id_and_side);
  if (!made || !queue_.waiters.is_preview_requested(made->id, made->value)) return;
  post([this, made = *made] {
    if (auto png = store_.find_result(made.id, result_name(made.value)))
      queue_.waiters.add_preview(made.id, made.value, *std::move(png));
  });
}

}  // namespace queue
