#include "renderer/scene/gltf/document/json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "renderer/base/json_scan.h"

namespace helio::gltf {

using nlohmann::json;

namespace {

// The parser and everything that walks the tree may assume less nesting than this.
constexpr std::size_t kMaxDepth = 128;
// Upper bound of what one JSON value costs in nlohmann's tree: a map node with key and value, allocator overhead.
constexpr std::uint64_t kBytesPerValue = 160;

const json& empty_object() {
  static const json value = json::object();
  return value;
}

std::string quote(std::string text) {
  constexpr std::size_t kMax = 60;
  if (text.size() > kMax) text = text.substr(0, kMax) + "...";
  return text;
}

std::string show(const json& value) {
  return quote(value.dump(-1, ' ', true, json::error_handler_t::replace));
}

std::string show(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

bool contains(const Range& range, double value) {
  return std::isfinite(value) && value >= range.low && value <= range.high &&
         !(range.low_excluded && value == range.low);
}

// Finds how many bytes it takes to see that a text is not JSON; the tree-building parser does not say so for numbers
// that overflow.
struct PositionFinder : JsonScan {
  std::size_t position = 0;
  bool parse_error(std::size_t at, const std::string&, const json::exception&) override {
    position = at;
    return false;
  }
};

struct TextSize {
  std::uint64_t values = 1;
  std::size_t depth = 0, deepest_at = 0;
};

// Counts separators outside strings: no value of the tree comes without one.
TextSize measure(std::span<const std::uint8_t> text) {
  TextSize size;
  std::size_t depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::uint8_t c = text[i];
    if (in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        in_string = false;
      continue;
    }
    switch (c) {
      case '"':
        in_string = true;
        break;
      case '[':
      case '{':
        ++size.values;
        if (++depth > size.depth) size.depth = depth, size.deepest_at = i;
        break;
      case ']':
      case '}':
        if (depth > 0) --depth;
        break;
      case ',':
      case ':':
        ++size.values;
        break;
      default:
        break;
    }
  }
  return size;
}

constexpr const char* kEmpty = "is empty, allowed: one item or more";
constexpr const char* kAsAbsent = "read as absent";

}  // namespace

std::optional<double> nearest_within(const Range& range, double value) {
  const double width = range.high - range.low;
  const auto near = [width](double end, double off) {
    return off <= (width <= 10 ? 0.01 * width : end == 0 ? 1e-6 : 1e-6 * std::abs(end));
  };
  if (value < range.low && near(range.low, range.low - value) && !range.low_excluded) return range.low;
  if (value > range.high && near(range.high, value - range.high)) return range.high;
  return std::nullopt;
}

std::string describe(const Range& range) {
  if (std::isinf(range.low) && std::isinf(range.high)) return "any finite number";
  if (std::isinf(range.high)) return (range.low_excluded ? "above " : "at least ") + show(range.low);
  return (range.low_excluded ? "above " : "") + show(range.low) + " to " + show(range.high);
}

std::string operator/(const std::string& place, std::string_view key) {
  std::string result = place + "/";
  for (const char c : key) {
    if (c == '~')
      result += "~0";
    else if (c == '/')
      result += "~1";
    else
      result += c;
  }
  return result;
}

std::string operator/(const std::string& place, std::size_t index) {
  return place + "/" + std::to_string(index);
}

JsonObject::JsonObject(const json& value, std::string place, Diagnostics& diagnostics)
    : value_(&value), place_(std::move(place)), diagnostics_(&diagnostics), exists_(true) {
  if (!value.is_object()) {
    diagnostics.fail(place_, "is " + show(value) + ", expected an object");
    value_ = &empty_object();
  }
}

JsonObject JsonObject::absent(std::string place, Diagnostics& diagnostics) {
  return JsonObject(&empty_object(), std::move(place), diagnostics, false);
}

const json* JsonObject::find(const char* key) const {
  const auto found = value_->find(key);
  if (found == value_->end()) return nullptr;
  // Extras may be any value, null too.
  if (found->is_null() && std::string_view(key) != "extras") {
    diagnostics_->tolerate(place_ / key, "is null", kAsAbsent);
    return nullptr;
  }
  return &*found;
}

void JsonObject::wrong_type(const char* key, const char* wanted) const {
  diagnostics_->fail(place_ / key, "is " + show(*find(key)) + ", expected " + wanted);
}

bool JsonObject::has(const char* key) const {
  return find(key) != nullptr;
}
bool JsonObject::is_string(const char* key) const {
  return has(key) && find(key)->is_string();
}
bool JsonObject::is_number(const char* key) const {
  return has(key) && find(key)->is_number();
}
bool JsonObject::is_object(const char* key) const {
  return has(key) && find(key)->is_object();
}

bool JsonObject::require(const char* key) const {
  if (has(key)) return true;
  diagnostics_->fail(place_, std::string("misses the required property \"") + key + '"');
  return false;
}

bool JsonObject::require(std::initializer_list<const char*> keys) const {
  bool all = true;
  for (const char* key : keys) all = require(key) && all;
  return all;
}

void JsonObject::only(std::initializer_list<std::string_view> known) const {
  if (has("name") && !find("name")->is_string()) wrong_type("name", "a string");
  for (const auto& [key, value] : value_->items()) {
    if (key == "name" || key == "extras" || key == "extensions") continue;
    if (std::find(known.begin(), known.end(), key) == known.end()) diagnostics_->unread(place_ / key);
  }
}

std::vector<std::string> JsonObject::keys() const {
  std::vector<std::string> result;
  for (const auto& [key, value] : value_->items()) result.push_back(key);
  return result;
}

double JsonObject::number(const char* key, double fallback, Range range) const {
  const json* value = find(key);
  if (!value) return fallback;
  if (!value->is_number()) {
    wrong_type(key, "a number");
    return fallback;
  }
  const double number = value->get<double>();
  if (contains(range, number)) return number;
  const std::string problem = "is " + show(*value) + ", allowed: " + describe(range);
  if (const std::optional<double> meant = nearest_within(range, number)) {
    diagnostics_->tolerate(place_ / key, problem, "read as " + show(*meant));
    return *meant;
  }
  diagnostics_->fail(place_ / key, problem);
  return fallback;
}

std::uint64_t JsonObject::count(const char* key, std::uint64_t fallback, std::uint64_t low, std::uint64_t high) const {
  const json* value = find(key);
  if (!value) return fallback;
  const double number = value->is_number() ? value->get<double>() : std::nan("");
  if (!(number == std::floor(number))) {
    wrong_type(key, "an integer");
    return fallback;
  }
  if (!(number >= double(low) && number <= double(high))) {
    diagnostics_->fail(place_ / key,
                       "is " + show(*value) + ", allowed: " + std::to_string(low) + " to " + std::to_string(high));
    return fallback;
  }
  return std::uint64_t(number);
}

bool JsonObject::boolean(const char* key, bool fallback) const {
  const json* value = find(key);
  if (!value) return fallback;
  if (value->is_number_integer() && (*value == 0 || *value == 1)) {
    diagnostics_->tolerate(place_ / key, "is " + show(*value) + ", expected true or false",
                           *value == 1 ? "read as true" : "read as false");
    return *value == 1;
  }
  if (!value->is_boolean()) {
    wrong_type(key, "true or false");
    return fallback;
  }
  return value->get<bool>();
}

std::string JsonObject::string(const char* key, const char* fallback) const {
  const json* value = find(key);
  if (!value) return fallback;
  if (!value->is_string()) {
    wrong_type(key, "a string");
    return fallback;
  }
  return value->get<std::string>();
}

int JsonObject::reference(const char* key, std::size_t size, const char* what) const {
  const json* value = find(key);
  if (!value) return -1;
  const double number = value->is_number() ? value->get<double>() : std::nan("");
  if (!(number == std::floor(number)) || number < 0) {
    wrong_type(key, "an index");
    return -1;
  }
  if (number >= double(size)) {
    diagnostics_->fail(place_ / key, "is " + show(*value) + ", but there are " + std::to_string(size) + " " + what);
    return -1;
  }
  return int(number);
}

std::vector<int> JsonObject::references(const char* key, std::size_t size, const char* what) const {
  std::vector<int> result;
  const json* value = find(key);
  if (!value) return result;
  if (!value->is_array()) {
    wrong_type(key, "an array of indices");
    return result;
  }
  if (value->empty()) diagnostics_->tolerate(place_ / key, kEmpty, kAsAbsent);
  for (std::size_t i = 0; i < value->size(); ++i) {
    const json& item = (*value)[i];
    const double number = item.is_number() ? item.get<double>() : std::nan("");
    if (!(number == std::floor(number)) || number < 0) {
      diagnostics_->fail(place_ / key / i, "is " + show(item) + ", expected an index");
    } else if (number >= double(size)) {
      diagnostics_->fail(place_ / key / i, "is " + show(item) + ", but there are " + std::to_string(size) + " " + what);
    } else {
      result.push_back(int(number));
    }
  }
  return result;
}

std::vector<std::string> JsonObject::strings(const char* key) const {
  std::vector<std::string> result;
  const json* value = find(key);
  if (!value) return result;
  if (!value->is_array()) {
    wrong_type(key, "an array of strings");
    return result;
  }
  if (value->empty()) diagnostics_->tolerate(place_ / key, kEmpty, kAsAbsent);
  for (std::size_t i = 0; i < value->size(); ++i) {
    const json& item = (*value)[i];
    if (item.is_string())
      result.push_back(item.get<std::string>());
    else
      diagnostics_->fail(place_ / key / i, "is " + show(item) + ", expected a string");
  }
  return result;
}

std::vector<double> JsonObject::numbers(const char* key, std::size_t min_size, std::size_t max_size,
                                        Range range) const {
  std::vector<double> result;
  const json* value = find(key);
  if (!value) return result;
  if (!value->is_array()) {
    wrong_type(key, "an array of numbers");
    return result;
  }
  if (value->empty() && min_size < max_size) {
    diagnostics_->tolerate(place_ / key, kEmpty, kAsAbsent);
    return result;
  }
  if (value->size() < min_size || value->size() > max_size) {
    diagnostics_->fail(place_ / key, "has " + std::to_string(value->size()) +
                                         " elements, allowed: " + std::to_string(min_size) +
                                         (min_size == max_size ? "" : " to " + std::to_string(max_size)));
    return result;
  }
  result.reserve(value->size());
  for (std::size_t i = 0; i < value->size(); ++i) {
    const json& item = (*value)[i];
    if (!item.is_number()) {
      diagnostics_->fail(place_ / key / i, "is " + show(item) + ", expected a number");
      return {};
    }
    const double number = item.get<double>();
    const std::optional<double> meant = contains(range, number) ? number : nearest_within(range, number);
    const std::string problem = meant == number ? "" : "is " + show(item) + ", allowed: " + describe(range);
    if (!meant) {
      diagnostics_->fail(place_ / key / i, problem);
      return {};
    }
    if (!problem.empty()) diagnostics_->tolerate(place_ / key / i, problem, "read as " + show(*meant));
    result.push_back(*meant);
  }
  return result;
}

Rgb JsonObject::rgb(const char* key, const Rgb& fallback, Range range) const {
  const std::vector<double> v = numbers(key, 3, 3, range);
  return v.empty() ? fallback : Rgb(float(v[0]), float(v[1]), float(v[2]));
}

JsonObject JsonObject::object(const char* key) const {
  const json* value = find(key);
  return value ? JsonObject(*value, place_ / key, *diagnostics_) : absent(place_ / key, *diagnostics_);
}

std::size_t JsonObject::array_size(const char* key) const {
  const json* value = find(key);
  return value && value->is_array() ? value->size() : 0;
}

void JsonObject::each(const char* key, const std::function<void(const JsonObject&, std::size_t)>& visit) const {
  const json* value = find(key);
  if (!value) return;
  if (!value->is_array()) {
    wrong_type(key, "an array");
    return;
  }
  if (value->empty()) diagnostics_->tolerate(place_ / key, kEmpty, kAsAbsent);
  for (std::size_t i = 0; i < value->size(); ++i) visit(JsonObject((*value)[i], place_ / key / i, *diagnostics_), i);
}

namespace {

// A destructor of nlohmann's allocates a stack for what an array or object holds, and ends the process where it cannot.
// One of empty containers does not. Values are at most kMaxDepth levels deep.
void dismantle(json& value) noexcept {
  if (value.is_array()) {
    auto& values = value.get_ref<json::array_t&>();
    for (json& element : values) dismantle(element);
    values.clear();
  } else if (value.is_object()) {
    auto& values = value.get_ref<json::object_t&>();
    for (auto& [key, element] : values) dismantle(element);
    values.clear();
  }
}

}  // namespace

bool starts_with_byte_order_mark(std::span<const std::uint8_t> text) {
  return text.size() >= 3 && text[0] == 0xef && text[1] == 0xbb && text[2] == 0xbf;
}

JsonDocument::JsonDocument(std::unique_ptr<json> json) : json_(std::move(json)) {}
JsonDocument::JsonDocument(JsonDocument&&) noexcept = default;
JsonDocument& JsonDocument::operator=(JsonDocument&&) noexcept = default;
JsonDocument::~JsonDocument() {
  if (json_) dismantle(*json_);
}

Result<JsonDocument> JsonDocument::parse(std::span<const std::uint8_t> text, const std::string& file,
                                         std::size_t offset, MemoryBudget& budget) {
  const auto at = [&](std::size_t position) { return file + "@" + std::to_string(offset + position); };
  if (starts_with_byte_order_mark(text)) {
    text = text.subspan(3);
    offset += 3;
  }
  const TextSize size = measure(text);
  if (size.depth > kMaxDepth)
    return Error{ErrorCode::invalid_argument,
                 "the JSON is nested more than " + std::to_string(kMaxDepth) + " levels deep", at(size.deepest_at)};
  if (Status s = budget.reserve(size.values * kBytesPerValue + text.size(), at(0)); !s.ok()) return s.error();
  try {
    return JsonDocument(std::make_unique<json>(json::parse(text.begin(), text.end())));
  } catch (const json::exception& e) {
    PositionFinder finder;
    json::sax_parse(text.begin(), text.end(), &finder);
    std::string message = e.what();  // "[json.exception.parse_error.101] parse error at line ...: syntax error ..."
    if (const std::size_t end = message.find("] "); end != std::string::npos) message = message.substr(end + 2);
    return Error{ErrorCode::invalid_argument, "not valid JSON: " + message,
                 at(finder.position > 0 ? finder.position - 1 : 0)};
  }
}

JsonObject JsonDocument::root(Diagnostics& diagnostics) const {
  return JsonObject(*json_, "", diagnostics);
}

}  // namespace helio::gltf
