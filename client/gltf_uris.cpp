#include "client/gltf_uris.h"

#include <filesystem>
#include <istream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <unordered_set>

namespace helio {

namespace {

// Sees the document pass by; keeps the values of "uri" only.
class UriCollector : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::vector<std::string> take() { return std::move(uris_); }

  bool key(string_t& name) override {
    is_uri_ = name == "uri" || name == "image";
    return true;
  }
  bool string(string_t& text) override {
    if (is_uri_ && text.compare(0, 5, "data:") != 0 && !text.empty() && seen_.insert(text).second)
      uris_.push_back(text);
    return value();
  }
  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override { return value(); }
  bool end_object() override { return value(); }
  bool start_array(std::size_t) override { return value(); }
  bool end_array() override { return value(); }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  bool value() {
    is_uri_ = false;
    return true;
  }

  bool is_uri_ = false;
  std::vector<std::string> uris_;
  std::unordered_set<std::string> seen_;
};

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::vector<std::string> find_gltf_uris(std::istream& json) {
  UriCollector collector;
  nlohmann::json::sax_parse(json, &collector, nlohmann::json::input_format_t::json, false);
  return collector.take();
}

std::string percent_decode(const std::string& text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    if (low >= 0) {
      decoded += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

std::optional<std::string> relative_path_of(const std::string& uri) {
  const std::string text = percent_decode(uri);
  if (text.find_first_of(std::string_view("\\:\0", 3)) != std::string::npos) return std::nullopt;
  const std::filesystem::path path = std::filesystem::path(text).lexically_normal();
  if (path.empty() || path.is_absolute() || !path.has_filename()) return std::nullopt;
  if (*path.begin() == ".." || path == ".") return std::nullopt;
  return path.generic_string();
}

}  // namespace helio
