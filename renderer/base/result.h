// Value-or-error return type and the list of problems that validation collects.
//
// An Error is meant to be shown to a person as one line: `where: message`. `where` names the place (a field path such
// as "view.camera.position", or a file and JSON pointer such as "box.gltf/accessors/3/count"); `message` is a clause
// that gives the value found and the range allowed.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "renderer/base/check.h"

namespace helio {

enum class ErrorCode {
  invalid_argument,     // the caller's input is wrong; the message names the field and the allowed range
  not_found,            // an id or a file does not exist
  failed_precondition,  // the request is well formed but the state forbids it
  resource_exhausted,   // a configured limit is exceeded; the message names the limit
  permission_denied,    // a path outside the configured roots
  unimplemented,        // a required extension or feature that we do not know
  cancelled,            // the caller gave up
  unavailable,          // the daemon is draining or cannot be reached
  internal,             // a bug or a library failure
};

struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;
  std::string where;
  double retry_after_s = 0;  // when the same request may succeed; 0: not by waiting

  std::string to_string() const { return where.empty() ? message : where + ": " + message; }
};

struct Unit {};

// Holds either a T or an Error. Accessing the wrong one is a programming error.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & {
    HELIO_CHECK(ok());
    return *std::get_if<0>(&state_);
  }
  const T& value() const& {
    HELIO_CHECK(ok());
    return *std::get_if<0>(&state_);
  }
  T&& value() && {
    HELIO_CHECK(ok());
    return std::move(*std::get_if<0>(&state_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const& {
    HELIO_CHECK(!ok());
    return *std::get_if<1>(&state_);
  }
  Error&& error() && {
    HELIO_CHECK(!ok());
    return std::move(*std::get_if<1>(&state_));
  }

 private:
  std::variant<T, Error> state_;
};

using Status = Result<Unit>;
inline Status ok_status() {
  return Unit{};
}

// Collects every problem of one input so that all are reported at once.
class Problems {
 public:
  void add(std::string where, std::string message) { items_.push_back({std::move(where), std::move(message)}); }
  bool empty() const { return items_.empty(); }
  std::size_t size() const { return items_.size(); }

  struct Item {
    std::string where, message;
  };
  const std::vector<Item>& items() const { return items_; }

  // One Error whose message joins all problems with "; ". Precondition: not empty().
  Error to_error(ErrorCode code = ErrorCode::invalid_argument) const {
    HELIO_CHECK(!empty());
    std::string all;
    for (const Item& item : items_) {
      if (!all.empty()) all += "; ";
      all += item.where.empty() ? item.message : item.where + ": " + item.message;
    }
    return Error{code, std::move(all), {}};
  }

 private:
  std::vector<Item> items_;
};

}  // namespace helio
