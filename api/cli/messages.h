#pragma once
/// Errors and scene issues as lines of text.

#include <cstdio>
#include <string>
#include <vector>

#include "api/cli/options.h"
#include "api/document.h"
#include "tracer/render.h"

namespace cli {

/// Prints "whittle: MESSAGE" on standard error and returns `code`.
ExitCode fail(const std::string& message, ExitCode code = environment_failure);

/// Prints why a render ended without an image: `if_cancelled`, the issue of an asset, or the failure.
ExitCode fail(const tracer::Failure& failure, const std::string& if_cancelled);

/// The issues of a rejected document; one that cannot be parsed has one issue at the root.
std::vector<tracer::Issue> issues_of(const api::Refusal& refusal);

/// One line per issue: pointer, code, rule, separated by one space: "#/objects/3/radius out_of_range must be > 0, got
/// -1". A document that is not JSON has line and column instead of a pointer. Control characters of the document are
/// shown as \xNN (%NN in a pointer), so that an issue stays on one line and cannot control the terminal.
void print_issue(std::FILE* file, const tracer::Issue& issue);
void print_issues(std::FILE* file, const api::Refusal& refusal);

/// Parts of a model that its document does not have, one a line.
void print_omitted(std::FILE* file, const std::vector<std::string>& omitted);

/// "warning " and the issue, for each warning of a valid scene.
void print_warnings(std::FILE* file, const tracer::Scene& scene);

}  // namespace cli
