#include "server/base/log_format.h"

#include <spdlog/details/log_msg.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <ctime>
#include <optional>
#include <utility>
#include <vector>

namespace helio {
namespace {

// Length of the UTF-8 sequence that the text begins with, without overlong forms, surrogates and what lies beyond
// U+10FFFF (RFC 3629, section 4); 0: it begins with none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? std::uint8_t(text[i]) : std::uint8_t(0); };
  const auto tail = [&](std::size_t i, unsigned low = 0x80, unsigned high = 0xbf) {
    return byte(i) >= low && byte(i) <= high;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return tail(1) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef)
    return tail(1, first == 0xe0 ? 0xa0 : 0x80, first == 0xed ? 0x9f : 0xbf) && tail(2) ? 3 : 0;
  if (first >= 0xf0 && first <= 0xf4)
    return tail(1, first == 0xf0 ? 0x90 : 0x80, first == 0xf4 ? 0x8f : 0xbf) && tail(2) && tail(3) ? 4 : 0;
  return 0;
}

bool is_control(char c) {
  return std::uint8_t(c) < ' ' || c == 127;
}

// `backslash`: how a byte that is no UTF-8 begins.
void append_escaped(std::string& out, std::string_view text, std::string_view backslash, bool json) {
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0) {
      out += fmt::format("{}x{:02x}", backslash, std::uint8_t(c));
      ++i;
      continue;
    }
    if (c == '\n') {
      out += "\\n";
    } else if (c == '\r') {
      out += "\\r";
    } else if (c == '\t') {
      out += "\\t";
    } else if (is_control(c)) {
      out += fmt::format("\\u{:04x}", std::uint8_t(c));
    } else {
      if (json && (c == '"' || c == '\\')) out += '\\';
      out += text.substr(i, length);
    }
    i += length;
  }
}

std::string json_string(std::string_view text) {
  std::string out = "\"";
  append_escaped(out, text, "\\\\", true);
  return out += '"';
}

bool is_plain(char c) {
  return c > ' ' && c != 127 && c != '"' && c != '\\' && c != '=';
}

bool is_word(std::string_view text) {
  if (text.empty()) return false;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0 || (length == 1 && !is_plain(text[i]))) return false;
    i += length;
  }
  return true;
}

bool is_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

// The bytes of the JSON string that the text begins with, quotes included; 0: none.
std::size_t json_string_length(std::string_view text) {
  if (!text.starts_with('"')) return 0;
  for (std::size_t i = 1; i < text.size();) {
    if (text[i] == '"') return i + 1;
    if (text[i] == '\\') {
      const char kind = i + 1 < text.size() ? text[i + 1] : '\0';
      if (kind == 'u') {
        const std::string_view digits = text.substr(i + 2, 4);
        const bool hex = digits.size() == 4 && std::all_of(digits.begin(), digits.end(), [](char c) {
          return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
        });
        if (!hex) return 0;
        i += 6;
      } else if (kind != '\0' && std::string_view("\"\\/bfnrt").find(kind) != std::string_view::npos) {
        i += 2;
      } else {
        return 0;
      }
      continue;
    }
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0 || is_control(text[i])) return 0;
    i += length;
  }
  return 0;
}

// RFC 8259, section 6, short enough for a double to hold it.
bool is_number(std::string_view text) {
  if (text.size() > 17) return false;
  std::size_t i = 0;
  const auto digits = [&] {
    const std::size_t begin = i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    return i - begin;
  };
  if (i < text.size() && text[i] == '-') ++i;
  const bool zero = i < text.size() && text[i] == '0';
  const std::size_t whole = digits();
  if (whole == 0 || (zero && whole > 1)) return false;
  if (i < text.size() && text[i] == '.') {
    ++i;
    if (digits() == 0) return false;
  }
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    ++i;
    if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
    const std::size_t exponent = digits();
    if (exponent == 0 || exponent > 2) return false;
  }
  return i == text.size();
}

// Digits of these are no numbers.
bool holds_id(std::string_view name) {
  static constexpr std::array kIds = {"session", "job", "scene", "from", "reference", "comparison", "id", "peer", "by"};
  return std::find(kIds.begin(), kIds.end(), name) != kIds.end();
}

struct Field {
  std::string_view name, value;
  bool quoted = false;
};

struct Token {
  std::size_t begin = 0;
  std::optional<Field> field;
};

// From `at` to the next space, or to the end of a quoted value.
Token next_token(std::string_view text, std::size_t& at) {
  Token token{at, {}};
  const std::size_t space = std::min(text.find(' ', at), text.size());
  const std::size_t equals = text.find('=', at);
  if (equals < space && is_name(text.substr(at, equals - at))) {
    const std::string_view name = text.substr(at, equals - at), rest = text.substr(equals + 1);
    const std::size_t quoted = json_string_length(rest);
    const std::size_t after = equals + 1 + quoted;
    if (quoted > 0 && (after == text.size() || text[after] == ' ')) {
      token.field = Field{name, rest.substr(0, quoted), true};
      at = after;
      return token;
    }
    if (const std::string_view word = text.substr(equals + 1, space - equals - 1); is_word(word))
      token.field = Field{name, word, false};
  }
  at = space;
  return token;
}

struct Line {
  std::string_view message;
  std::vector<Field> fields;
};

// The fields are those of the longest tail that consists of nothing else.
Line read_line(std::string_view payload) {
  std::vector<Token> tokens;
  for (std::size_t at = 0; at < payload.size();) {
    tokens.push_back(next_token(payload, at));
    while (at < payload.size() && payload[at] == ' ') ++at;
  }
  Line line{payload, {}};
  static constexpr std::array kReserved = {"time", "level", "message"};
  for (auto token = tokens.rbegin(); token != tokens.rend() && token->field; ++token) {
    const std::string_view name = token->field->name;
    const bool taken = std::any_of(line.fields.begin(), line.fields.end(),
                                   [&](const Field& other) { return other.name == name; });
    if (taken || std::find(kReserved.begin(), kReserved.end(), name) != kReserved.end()) break;
    line.fields.push_back(*token->field);
    line.message = payload.substr(0, token->begin);
  }
  std::reverse(line.fields.begin(), line.fields.end());
  while (line.message.ends_with(' ')) line.message.remove_suffix(1);
  return line;
}

// 2026-11-26T20:36:14.824Z
std::string time_text(std::chrono::system_clock::time_point time) {
  using namespace std::chrono;
  const auto whole = floor<seconds>(time);
  const std::time_t since = system_clock::to_time_t(whole);
  std::tm utc{};
  gmtime_r(&since, &utc);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                     utc.tm_hour, utc.tm_min, utc.tm_sec, duration_cast<milliseconds>(time - whole).count());
}

class LineFormatter final : public spdlog::formatter {
 public:
  explicit LineFormatter(LogFormat format) : format_(format) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const std::string_view payload(message.payload.data(), message.payload.size());
    const auto name = spdlog::level::to_string_view(message.level);
    const auto time = std::chrono::time_point_cast<std::chrono::system_clock::duration>(message.time);
    const std::string line = (format_ == LogFormat::json ? json_line : text_line)(
        payload, std::string_view(name.data(), name.size()), time);
    out.append(line.data(), line.data() + line.size());
    out.push_back('\n');
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<LineFormatter>(format_); }

 private:
  const LogFormat format_;
};

}  // namespace

std::string logged(std::string_view text) {
  return is_word(text) ? std::string(text) : json_string(text);
}

std::string text_line(std::string_view payload, std::string_view level, std::chrono::system_clock::time_point time) {
  std::string line = fmt::format("{} {} ", time_text(time), level);
  append_escaped(line, payload, "\\", false);
  return line;
}

std::string json_line(std::string_view payload, std::string_view level, std::chrono::system_clock::time_point time) {
  const Line line = read_line(payload);
  std::string out = fmt::format(R"({{"time":"{}","level":"{}","message":)", time_text(time), level);
  out += json_string(line.message);
  for (const Field& field : line.fields) {
    out += fmt::format(R"(,"{}":)", field.name);
    const bool as_it_is = field.quoted || field.value == "true" || field.value == "false" || is_number(field.value);
    if (as_it_is && !(holds_id(field.name) && !field.quoted)) {
      out += field.value;
    } else {
      out += json_string(field.value);
    }
  }
  return out += '}';
}

std::unique_ptr<spdlog::formatter> make_log_formatter(LogFormat format) {
  return std::make_unique<LineFormatter>(format);
}

}  // namespace helio
