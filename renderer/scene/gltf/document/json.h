// Typed, checked reading of a glTF's JSON. Every accessor that finds the wrong type, length or range says so with the
// value's JSON pointer and goes on with the fallback, so that one pass finds every problem. Slips that leave the meaning
// beyond doubt are tolerated (Diagnostics::tolerate): numbers a hair outside of their range, empty arrays, null for a
// property that may be absent, 0 and 1 for false and true.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/result.h"
#include "renderer/scene/description/load_diagnostics.h"
#include "renderer/scene/description/memory_budget.h"

namespace helio::gltf {

// Appends one reference token to a JSON pointer (RFC 6901: ~ and / are escaped).
std::string operator/(const std::string& place, std::string_view key);
std::string operator/(const std::string& place, std::size_t index);

struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_excluded = false;
};
inline constexpr Range kAny{};
inline constexpr Range kUnit{0, 1};
inline constexpr Range kNonNegative{0};
inline constexpr Range kPositive{0, std::numeric_limits<double>::infinity(), true};
// The nearest value of the range, where `value` is a hair outside: 1 % of the range's width; where that is above 10 or
// infinite, 1e-6 of the end, or 1e-6 if it is 0. Nothing where it is farther away, or where the end is excluded.
std::optional<double> nearest_within(const Range& range, double value);
// "at least 0", "0 to 1", ...
std::string describe(const Range& range);
// Integers beyond 2^53 are not exact in JSON.
inline constexpr std::uint64_t kMaxCount = 1ull << 53;

class JsonObject {
 public:
  // A value that is not an object is a failure and reads as an empty one.
  JsonObject(const nlohmann::json& value, std::string place, Diagnostics& diagnostics);
  // What an absent object reads as.
  static JsonObject absent(std::string place, Diagnostics& diagnostics);

  bool exists() const { return exists_; }
  const std::string& place() const { return place_; }
  Diagnostics& diagnostics() const { return *diagnostics_; }

  bool has(const char* key) const;
  // Fails when the key is missing.
  bool require(const char* key) const;
  // As above for all of them: each missing one is a failure.
  bool require(std::initializer_list<const char*> keys) const;
  // Reports every key outside `known` (and name, extras, extensions) as unread.
  void only(std::initializer_list<std::string_view> known) const;
  std::vector<std::string> keys() const;

  double number(const char* key, double fallback, Range range = kAny) const;
  std::uint64_t count(const char* key, std::uint64_t fallback, std::uint64_t low = 0,
                      std::uint64_t high = kMaxCount) const;
  bool boolean(const char* key, bool fallback) const;
  std::string string(const char* key, const char* fallback = "") const;
  // Index into an array of `size` elements; -1 when absent. An index outside is a failure ("what" names the array).
  int reference(const char* key, std::size_t size, const char* what) const;
  std::vector<int> references(const char* key, std::size_t size, const char* what) const;
  std::vector<std::string> strings(const char* key) const;
  // An array of min_size to max_size numbers; empty when absent or wrong. An empty one is read as absent where the
  // length is free.
  std::vector<double> numbers(const char* key, std::size_t min_size, std::size_t max_size, Range range = kAny) const;
  Rgb rgb(const char* key, const Rgb& fallback, Range range) const;

  // The object under key; absent when there is none.
  JsonObject object(const char* key) const;
  JsonObject extension(const char* name) const { return object("extensions").object(name); }
  // Calls visit for each object of the array under key; an empty array is a slip (glTF arrays have minItems 1).
  void each(const char* key, const std::function<void(const JsonObject&, std::size_t)>& visit) const;
  // Calls visit for each key of this object whose value is an object.
  std::size_t array_size(const char* key) const;
  bool is_string(const char* key) const;
  bool is_number(const char* key) const;
  bool is_object(const char* key) const;

 private:
  JsonObject(const nlohmann::json* value, std::string place, Diagnostics& diagnostics, bool exists)
      : value_(value), place_(std::move(place)), diagnostics_(&diagnostics), exists_(exists) {}
  const nlohmann::json* find(const char* key) const;
  void wrong_type(const char* key, const char* wanted) const;

  const nlohmann::json* value_;
  std::string place_;
  Diagnostics* diagnostics_;
  bool exists_;
};

// glTF forbids one; parse() skips it.
bool starts_with_byte_order_mark(std::span<const std::uint8_t> text);

// A parsed text. The JSON's memory is reserved in the budget before parsing, from a count of its values.
class JsonDocument {
 public:
  // Errors: invalid_argument with "file@byte", resource_exhausted.
  static Result<JsonDocument> parse(std::span<const std::uint8_t> text, const std::string& file, std::size_t offset,
                                    MemoryBudget& budget);
  JsonObject root(Diagnostics& diagnostics) const;

  JsonDocument(JsonDocument&&) noexcept;
  JsonDocument& operator=(JsonDocument&&) noexcept;
  ~JsonDocument();

 private:
  explicit JsonDocument(std::unique_ptr<nlohmann::json> json);
  std::unique_ptr<nlohmann::json> json_;
};

}  // namespace helio::gltf
