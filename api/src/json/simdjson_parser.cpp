#include "api/src/json/simdjson_parser.h"

#include <simdjson.h>

#include <cmath>
#include <utility>

#include "api/src/json/tape_writer.h"

namespace api::json {
namespace {

namespace ondemand = simdjson::ondemand;

/// Writes values down as they are read. False: something is wrong, whatever it is.
class Reader {
 public:
  Reader(TapeWriter& writer, const DocumentLimits& limits) : writer_(writer), limits_(limits) {}

  bool read(ondemand::document& document) {
    ondemand::json_type type{};
    if (document.type().get(type) != simdjson::SUCCESS) return false;
    if (type != ondemand::json_type::array && type != ondemand::json_type::object) return false;  // no scene
    ondemand::value root;
    if (document.get_value().get(root) != simdjson::SUCCESS || !value(root)) return false;
    return document.current_location().error() == simdjson::OUT_OF_BOUNDS;  // nothing follows
  }

 private:
  bool value(ondemand::value& it) {  // NOLINT(misc-no-recursion)
    ondemand::json_type type{};
    if (it.type().get(type) != simdjson::SUCCESS) return false;
    switch (type) {
      case ondemand::json_type::array:
        return array(it);
      case ondemand::json_type::object:
        return object(it);
      case ondemand::json_type::number:
        return number(it);
      case ondemand::json_type::string: {
        std::string_view text;
        return it.get_string().get(text) == simdjson::SUCCESS && writer_.string(text);
      }
      case ondemand::json_type::boolean: {
        bool truth = false;
        return it.get_bool().get(truth) == simdjson::SUCCESS && writer_.boolean(truth);
      }
      case ondemand::json_type::null: {
        bool null = false;
        return it.is_null().get(null) == simdjson::SUCCESS && null && writer_.null();
      }
    }
    return false;
  }

  bool array(ondemand::value& it) {  // NOLINT(misc-no-recursion)
    ondemand::array elements;
    if (++depth_ > depth_max || !writer_.open(Kind::array) || it.get_array().get(elements) != simdjson::SUCCESS)
      return false;
    for (auto found : elements) {
      ondemand::value element;
      if (found.get(element) != simdjson::SUCCESS || !value(element)) return false;
    }
    --depth_;
    return writer_.close();
  }

  bool object(ondemand::value& it) {  // NOLINT(misc-no-recursion)
    ondemand::object members;
    if (++depth_ > depth_max || !writer_.open(Kind::object) || it.get_object().get(members) != simdjson::SUCCESS)
      return false;
    for (auto found : members) {
      std::string_view key;
      if (found.unescaped_key().get(key) != simdjson::SUCCESS || !writer_.key(key)) return false;
      ondemand::value member;
      if (found.value().get(member) != simdjson::SUCCESS || !value(member)) return false;
    }
    --depth_;
    return writer_.close();
  }

  bool number(ondemand::value& it) {
    std::string_view text = it.raw_json_token();  // and the space behind it
    double value = 0;
    if (it.get_double().get(value) != simdjson::SUCCESS) return false;
    if (value == 0 || text.size() > limits_.number_chars) {
      text = text.substr(0, text.find_first_of(" \t\r\n"));
      if (text == "-0") value = 0;  // a whole number has no such sign
      if (text.size() > limits_.number_chars) return false;
    }
    return std::isfinite(value) && writer_.number(value);
  }

  /// What is deeper is for the parser that keeps no stack.
  static constexpr int depth_max = 64;
  TapeWriter& writer_;
  const DocumentLimits& limits_;
  int depth_ = 0;
};

}  // namespace

std::optional<Tape> parse_with_simdjson(std::string_view bytes, const DocumentLimits& limits) {
  if (bytes.size() > simdjson_bytes_max) return std::nullopt;
  const simdjson::padded_string padded(bytes);
  if (padded.size() != bytes.size()) return std::nullopt;  // no memory
  simdjson::ondemand::parser parser;
  ondemand::document document;
  if (parser.iterate(padded).get(document) != simdjson::SUCCESS) return std::nullopt;
  TapeWriter writer(bytes, limits);
  if (!Reader(writer, limits).read(document)) return std::nullopt;
  return std::move(writer.tape);
}

}  // namespace api::json
