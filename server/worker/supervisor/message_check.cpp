#include "server/worker/supervisor/message_check.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <vector>

#include "server/queue/job_waiters.h"
#include "tracer/encode.h"
#include "tracer/sha256.h"

namespace worker {
namespace {

/// Codes of failures that the worker finds itself; the others are of the daemon.
constexpr std::array<std::string_view, 5> failure_codes{"bad_scene", "bad_asset", "out_of_memory", "internal",
                                                        assets_unavailable};

/// 1000 issues with their pointers take about 100 KB.
constexpr std::size_t problem_bytes_max = 1u << 20;
constexpr std::size_t issues_max = 1000;

bool is_short_text(const std::string& text) {
  return text.size() <= 256 && std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
}

std::string violation_of(const queue::Problem& problem) {
  std::size_t bytes = problem.detail.size();
  for (const tracer::Issue& issue : problem.errors)
    bytes += issue.pointer.size() + issue.code.size() + issue.detail.size();
  const bool known = std::ranges::find(failure_codes, problem.code) != failure_codes.end();
  if (!known) return "sent a failure with an unknown code";
  if (bytes > problem_bytes_max || problem.errors.size() > issues_max) return "sent a failure that is too long";
  return {};
}

/// The type of a file that the job may have; empty for other names.
std::string_view media_type_of(const std::string& name, const queue::Job& job) {
  if (job.kind == queue::JobKind::measure) {
    for (const FileType& file : measurement_files)
      if (name == file.name) return file.media_type;
    return {};
  }
  for (const tracer::Format format : tracer::all_formats) {
    const std::string extension(tracer::row(format).extension);
    const bool requested = (" " + job.formats + " ").find(" " + extension + " ") != std::string::npos;
    if (requested && name == tracer::file_name(format)) return tracer::row(format).media_type;
  }
  return {};
}

std::string violation_of(const std::vector<Image>& files, const queue::Job& job) {
  if (files.empty()) return "sent a result without files";
  std::set<std::string_view> names;
  for (const Image& image : files) {
    const std::string_view media_type = media_type_of(image.name, job);
    if (media_type.empty() || !names.insert(image.name).second) return "sent a result with an invalid file name";
    if (image.media_type != media_type) return "sent a result with an invalid media type";
    const bool depends_on_size = job.kind == queue::JobKind::render || image.name == "reference.exr";
    const std::uint64_t bytes_max = depends_on_size ? image_bytes_max(job.width, job.height) : measurement_bytes_max;
    struct stat status {};
    if (fstat(image.bytes.get(), &status) != 0 || static_cast<std::uint64_t>(status.st_size) > bytes_max)
      return "sent a file that is larger than " + std::to_string(bytes_max) + " bytes";
  }
  return {};
}

}  // namespace

std::string violation_of(const Message& message) {
  if (std::holds_alternative<Configure>(message) || std::holds_alternative<Assign>(message) ||
      std::holds_alternative<Cancel>(message) || std::holds_alternative<PreviewRequest>(message) ||
      std::holds_alternative<ImageTask>(message) || std::holds_alternative<FileResponse>(message) ||
      std::holds_alternative<TraceTask>(message) || std::holds_alternative<TaskTaken>(message) ||
      std::holds_alternative<TaskDone>(message) || std::holds_alternative<Helpers>(message))
    return "sent a message that only the daemon sends";
  if (std::holds_alternative<FileRequest>(message)) return "sent a message of the other socket";
  if (const auto* ready = std::get_if<Ready>(&message)) {
    if (!is_short_text(ready->build) || !is_short_text(ready->sandbox)) return "sent a name that is no short text";
  } else if (const auto* failed = std::get_if<Failed>(&message)) {
    return violation_of(failed->problem);
  } else if (const auto* preview = std::get_if<PreviewResponse>(&message)) {
    const std::uint32_t side = preview->side;
    if (side == 0 || side > queue::preview_side_max || preview->png.size() > image_bytes_max(side, side))
      return "sent a preview of the wrong size";
  } else if (const auto* published = std::get_if<PublishTasks>(&message)) {
    for (const queue::NewTask& task : published->tasks)
      if (!tracer::is_sha256(task.key) || task.part.size() > task_bytes_max) return "sent an invalid task";
  } else if (const auto* traced = std::get_if<TaskTraced>(&message)) {
    if (!tracer::is_sha256(traced->key) || traced->result.size() > task_bytes_max)
      return "sent an invalid result of a task";
  } else if (const auto* update = std::get_if<MeasurementUpdate>(&message)) {
    if (!api::read_report(update->summary)) return "sent a measurement without a valid report";
  }
  return {};
}

tracer::Result<api::ReportFigures, std::string> check_result(const Finished& result, const queue::Job& job) {
  const auto figures = api::read_report(result.report);
  if (!figures) return std::string("sent a result without a valid report");
  std::string violation = violation_of(result.images, job);
  if (!violation.empty()) return violation;
  return *figures;
}

}  // namespace worker
