#pragma once
/// The reader's cursor: a value and its place in the document. Taking a field or an element extends the place, so every
/// issue has its JSON pointer without effort at the call. A cursor points at the one around it; both are on the stack.

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "api/reader/json_parser.h"

namespace api {

struct Cursor {
  const Cursor* parent = nullptr;
  std::string_view key{};  ///< name of a member
  std::size_t index = 0;   ///< position of an element
  bool is_member = false;
  json::Node* node = nullptr;
};

std::string pointer(const Cursor& at);                                  ///< RFC 6901, without '#'
std::string pointer_to_member(const Cursor& at, std::string_view key);  ///< the member may be missing

/// The named textures, materials, prototypes or assets of a document.
template <class Id>
struct Names {
  std::map<std::string_view, Id> ids;
  bool complete = true;  ///< false if the names could not be read: then unknown references are not reported
};

/// State of reading one document: its tape, the result and the issues.
struct Reading {
  Reading(json::Tape& document_tape, const Limits& document_limits) : tape(document_tape), limits(document_limits) {
    root.node = tape.root();
  }

  json::Tape& tape;
  const Limits& limits;
  Cursor root;
  Document document;
  Names<tracer::TextureId> textures;
  Names<tracer::AssetId> assets;  ///< by file name
  Names<tracer::MaterialId> materials;
  Names<tracer::PrototypeId> prototypes;
  std::vector<std::uint32_t> visible_lights;  ///< indices
  std::set<std::string_view> full;            ///< names of the limits that were reached while reading
  std::vector<tracer::Issue> issues;          ///< the first `issues_max`
  std::uint64_t omitted_issues = 0;

  static constexpr std::size_t issues_max = 1000;

  tracer::Scene& scene() { return document.scene; }
  /// True if the next issue is to be added, else counts it as omitted. A hostile document has millions; no text is made
  /// for those.
  bool can_add_issue();
  /// The issues in document order, then "too_many_issues" if some were omitted.
  std::vector<tracer::Issue> take_issues();
};

/// These three return false, so that a reader can return their result.
bool add_issue(Reading& reading, const Cursor& at, std::string_view code, std::string detail);
bool add_wrong_type(Reading& reading, const Cursor& at, std::string_view expected);  ///< "must be <expected>, got ..."
bool add_limit_exceeded(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound,
                        std::uint64_t seen);

/// Calls read(element) for each element. Adds an issue, which names the form `expected`, and returns false if the value
/// is not an array.
template <class ReadElement>
bool for_each_element(Reading& reading, const Cursor& at, const ReadElement& read,
                      std::string_view expected = "an array") {
  if (at.node->kind != json::Kind::array) return add_wrong_type(reading, at, expected);
  json::Node* element = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, element = reading.tape.next(element))
    read(Cursor{&at, {}, i, false, element});
  return true;
}

/// Calls read(member) for each member, in document order, duplicates included. Adds an issue, which names the form
/// `expected`, and returns false if the value is not an object.
template <class ReadMember>
bool for_each_member(Reading& reading, const Cursor& at, const ReadMember& read,
                     std::string_view expected = "an object") {
  if (at.node->kind != json::Kind::object) return add_wrong_type(reading, at, expected);
  json::Node* key = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, key = reading.tape.next(key + 1))
    read(Cursor{&at, key->string(), 0, true, key + 1});
  return true;
}

}  // namespace api
