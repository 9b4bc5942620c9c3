#pragma once
/// Maps from names to textures or materials, which may also be written in place: both count.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "api/src/reader/fields.h"

namespace api {

/// Whether one more material or texture may be made of the value; tells so at the first that may not. Those after it
/// are not read, so that what is too much is never held.
inline bool has_capacity(Reading& reading, const Cursor& at, std::size_t count, std::string_view limit,
                         std::uint64_t bound) {
  if (count < bound) return true;
  if (reading.full.insert(limit).second) {
    add_issue(reading, at, "limit_exceeded",
              "the limit " + std::string(limit) + " is " + std::to_string(bound) + ", those written in place included");
  }
  return false;
}

/// Adds each member of the map under its name; tells duplicates.
template <class Id>
void read_named(Reading& reading, const Cursor& at, Names<Id>& names, Id (*add)(Reading&, const Cursor&)) {
  names.complete = for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = names.ids.emplace(member.key, Id{});
    if (is_new) {
      place->second = add(reading, member);
    } else {
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is defined twice");
    }
  });
}

}  // namespace api
