#include "server/worker/process/task_tracer.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "tracer/parts.h"

namespace worker {

TaskTraced TaskTracer::trace(const TraceTask& task) noexcept {
  TaskTraced traced{task.job_id, task.key, true, {}};
  try {
    const std::shared_ptr<Scene> scene = scene_of(task.document);
    tracer::RenderControl control;
    if (const auto ready = compiled(*scene)) {
      auto result = tracer::trace_part(*ready, task.part, {}, control);
      if (result) {
        traced.failed = false;
        traced.result = *std::move(result);
      }
    }
    const std::lock_guard lock(mutex_);
    --scene->users;
    scene->used_at = Clock::now();
  } catch (const std::exception&) {
    // No memory: other workers trace the task.
  }
  return traced;
}

std::shared_ptr<TaskTracer::Scene> TaskTracer::scene_of(const std::string& document) {
  const std::lock_guard lock(mutex_);
  auto found = std::ranges::find_if(scenes_, [&](const auto& scene) { return scene->document == document; });
  if (found == scenes_.end()) {
    scenes_.push_front(std::make_shared<Scene>());
    scenes_.front()->document = document;
    if (scenes_.size() > scenes_max) scenes_.pop_back();
  } else {
    scenes_.splice(scenes_.begin(), scenes_, found);
  }
  ++scenes_.front()->users;
  return scenes_.front();
}

std::shared_ptr<const tracer::CompiledScene> TaskTracer::compiled(Scene& scene) {
  const std::lock_guard lock(scene.mutex);
  if (scene.compiled == nullptr && !scene.failed) {
    scene.compiled = compile_document(scene.document, files_, &cache_);
    scene.failed = scene.compiled == nullptr;
  }
  return scene.compiled;
}

void TaskTracer::drop_idle_scenes() {
  const std::lock_guard lock(mutex_);
  std::erase_if(scenes_, [](const std::shared_ptr<Scene>& scene) {
    return scene->users <= 0 && Clock::now() - scene->used_at > kept;
  });
}

}  // namespace worker
