/// Load of many nodes on one PostgreSQL database: the stores, queues and node links of the daemon, and a renderer that
/// sleeps. tests/bench/cluster_scale.py starts the database and this program:
///
///   cluster_scale URI NODES SLOTS JOBS   # slots of each node; jobs of the first phase

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <vector>

#include "server/queue/node_link.h"
#include "server/queue/queue.h"
#include "server/queue/queue_maintainer.h"
#include "server/storage/postgres/postgres_stores.h"

namespace {

using Steady = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

/// Jobs here have no images.
class NoArtifacts final : public queue::ArtifactStore {
 public:
  Stored put(int /*fd*/, bool /*durable*/) override { return {}; }
  void sync(const std::string& /*sha256*/) override {}
  std::unique_ptr<queue::ArtifactReader> open(const std::string&, bool) override { return nullptr; }
  void remove(const std::string& /*sha256*/) override {}
};

/// Waiting times and counts of all nodes.
struct Figures {
  std::mutex mutex;
  std::vector<double> waits_ms;
  std::atomic<std::int64_t> claims = 0, ends = 0;
};

/// Claims jobs for its slots and ends each after a sleep; one thread.
class SleepingRunner final : public queue::JobRunner {
 public:
  SleepingRunner(queue::Queue& queue, int slots, std::chrono::microseconds sleep, Figures& figures)
      : queue_(queue), slots_(slots), sleep_(sleep), figures_(figures), thread_([this] { run(); }) {}
  ~SleepingRunner() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  SleepingRunner(const SleepingRunner&) = delete;
  SleepingRunner& operator=(const SleepingRunner&) = delete;

  void notify(bool /*for_suspects*/) noexcept override {
    {
      const std::lock_guard lock(mutex_);
      may_wait_ = true;
    }
    changed_.notify_all();
  }
  void cancel(const std::string& /*id*/) noexcept override {}
  void request_preview(const std::string& /*id*/, std::uint32_t /*side*/) noexcept override {}
  void on_lease_lost(const queue::Lease& /*lease*/) noexcept override {}
  std::string not_ready() override { return {}; }
  [[nodiscard]] int running() const { return running_; }

 private:
  struct Render {
    Steady::time_point end;
    std::string id;
    std::int64_t fence;
    bool operator>(const Render& other) const { return end > other.end; }
  };

  void run() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
      const bool claims = may_wait_ && running_ < slots_;
      if (!claims && (renders_.empty() || renders_.top().end > Steady::now())) {
        const auto until = renders_.empty() ? Steady::now() + std::chrono::seconds(1) : renders_.top().end;
        changed_.wait_until(lock, until);
        continue;
      }
      if (claims) may_wait_ = false;
      lock.unlock();
      const bool found = claims && claim();
      end_due();
      lock.lock();
      may_wait_ = may_wait_ || found;
    }
  }

  bool claim() {
    const auto claim = queue_.lifecycle.claim();
    if (!claim) return false;
    ++figures_.claims;
    ++running_;
    {
      const std::lock_guard lock(figures_.mutex);
      figures_.waits_ms.push_back(static_cast<double>(*claim->job.started_at - claim->job.created_at));
    }
    renders_.push({Steady::now() + sleep_, claim->job.id, claim->fence});
    return true;
  }

  void end_due() {
    while (!renders_.empty() && renders_.top().end <= Steady::now()) {
      if (!queue_.lifecycle.succeed(renders_.top().id, renders_.top().fence, "{}", {})) std::abort();
      renders_.pop();
      ++figures_.ends;
      --running_;
      const std::lock_guard lock(mutex_);
      may_wait_ = true;
    }
  }

  queue::Queue& queue_;
  const int slots_;
  const std::chrono::microseconds sleep_;
  Figures& figures_;
  std::atomic<int> running_ = 0;
  std::priority_queue<Render, std::vector<Render>, std::greater<>> renders_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool may_wait_ = true, stopping_ = false;
  std::thread thread_;
};

std::string event_text(const queue::JobEvent& event) { return event.job.id + " " + event.state + "\n"; }

/// The parts of a daemon without HTTP and worker process.
struct SimulatedNode {
  SimulatedNode(const std::string& uri, const std::string& role, NoArtifacts& artifacts)
      : stores(uri, {.connections = role == "api" ? 8 : 2}),
        ids(stores.clock(), queue::system_random()),
        queue(stores.all(), artifacts, ids, stores.clock(), queue::no_log(),
              {.queued_limit = 10'000'000, .owner_queued_limit = 10'000'000}),
        events(event_text, stores.clock()),
        link(queue, events, stores.cluster(), stores.wakeups(), queue::no_log()) {
    queue.notifications.observe(&link);
    link.start(
        {.node = {.id = queue.boot_id(), .name = role, .role = role, .version = "1"}, .has_clients = role == "api"});
  }

  storage::postgres::PostgresStores stores;
  queue::IdSource ids;
  queue::Queue queue;
  queue::Events events;
  queue::NodeLink link;
  std::jthread renewer = queue::renew_leases(queue.lifecycle, queue::no_log());
  std::jthread maintainer = queue::maintain(queue.lifecycle, queue::no_log());
};

queue::Submission submission() {
  queue::Submission submission;
  submission.document = R"({"version": 1, "objects": []})" + std::string(270, ' ');
  submission.job.work = 1;
  submission.with_position = false;
  return submission;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Takes the events of all jobs, as a client of GET /v1/events.
class Listeners {
 public:
  Listeners(queue::Events& events, int count) {
    for (int i = 0; i < count; ++i) {
      all_.push_back(events.listen("", {}));
      auto& listener = *all_.back();
      listener.on_news([this] { news_ = true; });
    }
    thread_ = std::thread([this] {
      while (!stopping_) {
        if (!news_.exchange(false)) std::this_thread::sleep_for(std::chrono::milliseconds(2));
        for (auto& listener : all_) {
          const std::string text = listener->take(SIZE_MAX).text;
          taken_ += std::count(text.begin(), text.end(), '\n');
        }
      }
    });
  }
  ~Listeners() {
    stopping_ = true;
    thread_.join();
  }
  Listeners(const Listeners&) = delete;
  Listeners& operator=(const Listeners&) = delete;
  [[nodiscard]] std::int64_t taken() const { return taken_; }

 private:
  std::vector<std::unique_ptr<queue::Events::Listener>> all_;
  std::atomic<bool> news_ = false, stopping_ = false;
  std::atomic<std::int64_t> taken_ = 0;
  std::thread thread_;
};

void submit_all(SimulatedNode& api, int jobs) {
  constexpr int batch = 500;
  for (int done = 0; done < jobs; done += batch) {
    queue::BatchSubmission request;
    for (int i = 0; i < std::min(batch, jobs - done); ++i) request.jobs.push_back(submission());
    request.scene = {"{}", {}};
    for (queue::Submission& job : request.jobs) job.document = "{}";
    if (!api.queue.submission.submit_batch(std::move(request))) std::abort();
  }
}

using Runners = std::vector<std::unique_ptr<SleepingRunner>>;
using Nodes = std::vector<std::unique_ptr<SimulatedNode>>;

Runners start_runners(Nodes& nodes, int slots, std::chrono::microseconds sleep, Figures& figures) {
  Runners runners;
  for (auto& node : nodes) {
    runners.push_back(std::make_unique<SleepingRunner>(node->queue, slots, sleep, figures));
    node->queue.runner.attach(runners.back().get());
  }
  return runners;
}

void stop_runners(Nodes& nodes, Runners& runners) {
  for (auto& node : nodes) node->queue.runner.attach(nullptr);
  runners.clear();
}

/// All slots are busy with jobs that take no time.
void measure_throughput(SimulatedNode& api, Nodes& nodes, int slots, int jobs) {
  Figures figures;
  auto begin = Steady::now();
  submit_all(api, jobs);
  std::printf("submitted in batches: %.0f jobs/s\n", 1000 * jobs / Milliseconds(Steady::now() - begin).count());
  Listeners listeners(api.events, 100);
  begin = Steady::now();
  Runners runners = start_runners(nodes, slots, std::chrono::microseconds(0), figures);
  while (figures.ends < jobs) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const double seconds = Milliseconds(Steady::now() - begin).count() / 1000;
  std::this_thread::sleep_for(std::chrono::seconds(1));
  stop_runners(nodes, runners);
  std::printf("claimed and completed: %.0f jobs/s\nevents to 100 listeners: %.0f/s\n", jobs / seconds,
              static_cast<double>(listeners.taken()) / seconds);
  std::fflush(stdout);
}

/// Jobs come one by one, and most slots are idle.
void measure_latency(SimulatedNode& api, Nodes& nodes, int slots, int per_second, int seconds) {
  Figures figures;
  Runners runners = start_runners(nodes, slots, std::chrono::milliseconds(500), figures);
  const auto begin = Steady::now();
  std::vector<double> submits_ms;
  for (int i = 0; i < per_second * seconds; ++i) {
    std::this_thread::sleep_until(begin + i * std::chrono::microseconds(1'000'000 / per_second));
    const auto start = Steady::now();
    if (!api.queue.submission.submit(submission())) std::abort();
    submits_ms.push_back(Milliseconds(Steady::now() - start).count());
  }
  const double taken_s = Milliseconds(Steady::now() - begin).count() / 1000;
  while (figures.ends < per_second * seconds) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  stop_runners(nodes, runners);
  std::printf(
      "%.0f jobs/s one by one: submit median %.1f ms, p99 %.1f ms; submit to claim median %.0f ms, p99 %.0f ms\n",
      per_second * seconds / taken_s, percentile(submits_ms, 0.5), percentile(submits_ms, 0.99),
      percentile(figures.waits_ms, 0.5), percentile(figures.waits_ms, 0.99));
  std::fflush(stdout);
}

template <class Call>
double median_ms(Call call) {
  std::vector<double> times;
  for (int i = 0; i < 20; ++i) {
    const auto begin = Steady::now();
    call();
    times.push_back(Milliseconds(Steady::now() - begin).count());
  }
  return percentile(times, 0.5);
}

/// Single calls beside idle nodes, for the size that the database has now.
void measure_calls(SimulatedNode& api) {
  const double list = median_ms([&] { (void)api.queue.queries.list({}, {}, 50); });
  queue::JobFilter queued;
  queued.state = queue::JobState::queued;
  const double list_queued = median_ms([&] { (void)api.queue.queries.list(queued, {}, 50); });
  const double state = median_ms([&] { (void)api.queue.queries.state(); });
  submit_all(api, 20);
  const double claim = median_ms([&] {
    const auto claimed = api.queue.lifecycle.claim();
    if (!claimed || !api.queue.lifecycle.succeed(claimed->job.id, claimed->fence, "{}", {})) std::abort();
  });
  std::printf("list of 50: %.1f ms, of queued ones %.1f ms; queue state %.1f ms; claim and completion %.1f ms\n", list,
              list_queued, state, claim);
  std::fflush(stdout);
}

}  // namespace

int main(int argument_count, char** arguments) {
  if (argument_count != 5) {
    std::fprintf(stderr, "usage: cluster_scale URI NODES SLOTS JOBS\n");
    return 2;
  }
  const std::string uri = arguments[1];
  const int node_count = std::atoi(arguments[2]), slots = std::atoi(arguments[3]), jobs = std::atoi(arguments[4]);
  NoArtifacts artifacts;
  SimulatedNode api(uri, "api", artifacts);
  measure_calls(api);
  Nodes nodes;
  for (int i = 0; i < node_count; ++i) nodes.push_back(std::make_unique<SimulatedNode>(uri, "worker", artifacts));
  std::printf("%d nodes with %d slots each\n", node_count, slots);
  if (node_count == 0) return 0;
  measure_throughput(api, nodes, slots, jobs);
  measure_latency(api, nodes, slots, 100, 10);
}
