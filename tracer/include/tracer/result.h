#pragma once
/// A value or an error. Expected failures (invalid scene, limit, cancellation) are returned as errors; bugs assert; no
/// exception leaves the library except std::bad_alloc where a header names it.

#include <cassert>
#include <utility>
#include <variant>

namespace tracer {

template <class T, class E>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(E error) : content_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return content_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  /// Precondition of these: has_value().
  T& operator*() & {
    assert(has_value());
    return *std::get_if<0>(&content_);
  }
  const T& operator*() const& {
    assert(has_value());
    return *std::get_if<0>(&content_);
  }
  T&& operator*() && {
    assert(has_value());
    return std::move(*std::get_if<0>(&content_));
  }
  T* operator->() { return &**this; }
  const T* operator->() const { return &**this; }

  /// Precondition: !has_value().
  E& error() {
    assert(!has_value());
    return *std::get_if<1>(&content_);
  }
  const E& error() const {
    assert(!has_value());
    return *std::get_if<1>(&content_);
  }

 private:
  std::variant<T, E> content_;
};

}  // namespace tracer
