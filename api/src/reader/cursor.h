#pragma once
/// The reader's cursor: a value and where it is. Taking a field or an element extends the place, so every issue knows
/// where it belongs without effort at the call. Cursors point at the ones around them and live on the stack.

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "api/src/json/tape.h"

namespace api {

struct Cursor {
  const Cursor* parent = nullptr;
  std::string_view key{};  ///< for a member
  std::size_t index = 0;   ///< for an element
  bool is_member = false;
  json::Node* node = nullptr;
};

std::string pointer(const Cursor& at);                                  ///< RFC 6901, without '#'
std::string pointer_to_member(const Cursor& at, std::string_view key);  ///< of a member that may not exist

/// The things of one kind that a document names.
template <class Id>
struct Names {
  std::map<std::string_view, Id> ids;
  bool complete = true;  ///< false when they could not be read, which has been told: then no reference is to blame
};

/// One document being read: where it comes from, what it becomes, and what is wrong with it.
struct Reading {
  Reading(json::Tape& document_tape, const Limits& document_limits) : tape(document_tape), limits(document_limits) {}

  json::Tape& tape;
  const Limits& limits;
  Document document;
  Names<tracer::TextureId> textures;
  Names<tracer::AssetId> assets;  ///< by file name
  Names<tracer::MaterialId> materials;
  Names<tracer::PrototypeId> prototypes;
  std::set<std::string_view> full;    ///< names of the limits that were reached while reading
  std::vector<tracer::Issue> issues;  ///< the first `issues_max`
  std::uint64_t omitted_issues = 0;

  static constexpr std::size_t issues_max = 1000;

  tracer::Scene& scene() { return document.scene; }
  /// Whether the next issue is still told; counts it when not. A hostile document has millions: no text for those.
  bool can_add_issue();
};

/// Calls `read(element)` for each element; an issue and false when it is no array.
template <class ReadElement>
bool for_each_element(Reading& reading, const Cursor& at, ReadElement read);

void add_issue(Reading& reading, const Cursor& at, std::string_view code, std::string detail);
void add_wrong_type(Reading& reading, const Cursor& at, std::string_view expected);  ///< "must be <expected>, got ..."

std::string quoted(std::string_view text);     ///< in double quotes, at most 64 bytes of it, valid UTF-8
std::string describe(const json::Node& node);  ///< "the string \"red\"", "the number 3", "an array of 3", ...
std::string number_text(double value);         ///< shortest that reads back the same

// ---- implementation ------------------------------------------------------------------------------------------------

template <class ReadElement>
bool for_each_element(Reading& reading, const Cursor& at, ReadElement read) {
  if (at.node->kind != json::Kind::array) {
    add_wrong_type(reading, at, "an array");
    return false;
  }
  json::Node* element = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, element = reading.tape.next(element)) {
    read(Cursor{&at, {}, i, false, element});
  }
  return true;
}

}  // namespace api
