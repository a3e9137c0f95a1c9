#include "renderer/scene/gltf/document/uri.h"

#include <absl/strings/escaping.h>

#include <algorithm>

namespace helio::gltf {

namespace {

Error invalid(std::string message) {
  return {ErrorCode::invalid_argument, std::move(message), {}};
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

Result<std::string> percent_decode(std::string_view text, bool is_path) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
      continue;
    }
    const int high = i + 1 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
    if (high < 0 || low < 0) return invalid("has a broken % escape at character " + std::to_string(i));
    const char byte = char(high * 16 + low);
    if (is_path && byte == '\0') return invalid("has an escaped zero byte at character " + std::to_string(i));
    result += byte;
    i += 2;
  }
  return result;
}

// RFC 4648, section 4; padding may be missing.
Result<std::vector<std::uint8_t>> base64_decode(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::size_t size = text.size();
  while (size > 0 && text.size() - size < 2 && text[size - 1] == '=') --size;
  if (size % 4 == 1) return invalid("has base64 data of an impossible length");
  const std::string_view digits = text.substr(0, size);
  std::string bytes;
  // White space, which it takes for nothing, is no base64 either.
  if (!absl::Base64Unescape(absl::string_view(digits.data(), digits.size()), &bytes) ||
      bytes.size() != size / 4 * 3 + size % 4 * 3 / 4) {
    const std::size_t odd = digits.find_first_not_of(kDigits);
    if (odd != std::string_view::npos)
      return invalid("has a character that is not base64, " + std::to_string(odd) + " into the data");
    return invalid("has base64 data whose last digit holds bits of no byte");
  }
  return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
}

}  // namespace

bool is_data_uri(std::string_view uri) {
  constexpr std::string_view kScheme = "data:";
  return uri.size() >= kScheme.size() && std::equal(kScheme.begin(), kScheme.end(), uri.begin(),
                                                    [](char a, char b) { return a == (b | 0x20) || a == b; });
}

Result<DataUri> decode_data_uri(std::string_view uri, MemoryBudget& budget) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos) return invalid("is a data URI without a comma");
  const std::string_view header = uri.substr(5, comma - 5), data = uri.substr(comma + 1);
  // The bytes, and those that the decoder makes them of.
  if (Status s = budget.reserve(data.size(), 2, ""); !s.ok()) return s.error();
  DataUri result;
  result.media_type = std::string(header.substr(0, header.find(';')));
  std::transform(result.media_type.begin(), result.media_type.end(), result.media_type.begin(),
                 [](unsigned char c) { return char(c >= 'A' && c <= 'Z' ? c + 32 : c); });
  if (header.ends_with(";base64")) {
    Result<std::vector<std::uint8_t>> bytes = base64_decode(data);
    if (!bytes.ok()) return bytes.error();
    result.bytes = std::move(*bytes);
  } else {
    Result<std::string> text = percent_decode(data, false);
    if (!text.ok()) return text.error();
    result.bytes.assign(text->begin(), text->end());
  }
  return result;
}

bool has_scheme(std::string_view uri) {
  const std::size_t end = uri.find_first_of(":/?#");
  return end != std::string_view::npos && uri[end] == ':';
}

Result<std::string> resolve_uri(std::string_view base_file, std::string_view uri) {
  if (uri.empty()) return invalid("is an empty URI");
  if (uri.front() == ':') return invalid("is a URI with an empty scheme");
  Result<std::string> path = percent_decode(uri, true);
  if (!path.ok()) return path;
  if (path->front() == '/') return path;  // absolute: for the source to refuse
  const std::size_t slash = base_file.rfind('/');
  const std::string joined =
      slash == std::string_view::npos ? *path : std::string(base_file.substr(0, slash + 1)) + *path;

  std::vector<std::string_view> parts;
  std::string_view rest = joined;
  const bool rooted = rest.starts_with('/');
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('/'), rest.size());
    const std::string_view part = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (part.empty() || part == ".") continue;
    if (part == ".." && !parts.empty() && parts.back() != "..")
      parts.pop_back();
    else
      parts.push_back(part);
  }
  std::string result = rooted ? "/" : "";
  for (std::size_t i = 0; i < parts.size(); ++i) (result += i == 0 ? "" : "/") += parts[i];
  return result;
}

}  // namespace helio::gltf
