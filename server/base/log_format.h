// The lines of the daemon's log.
//
// A line says what happened and ends with its fields: "session created session=s-79 scene=9568 size=64x64". A field is
// NAME=VALUE with a name of [a-z0-9_] and a value that is one word, or a JSON string where it may hold anything
// (logged()). The format json turns each line into one JSON object of the same fields; no line is ever broken in two.
#pragma once

#include <spdlog/formatter.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

namespace helio {

enum class LogFormat { text, json };

// The value of a field: the text itself if it is one plain word, else a JSON string. Bytes that are not UTF-8 appear
// as \xNN.
std::string logged(std::string_view text);

// As text: "2026-11-26T20:36:14.824Z info session created session=s-79". Control characters, line breaks among them,
// and what is not UTF-8 are escaped.
std::string text_line(std::string_view payload, std::string_view level, std::chrono::system_clock::time_point time);
// {"time": RFC 3339 in UTC with milliseconds, "level": ..., "message": what stands before the fields, then the fields}.
// Values that are numbers, true or false are those of JSON, but for names that hold ids (session, job, ...); all others
// are strings. A line whose end does not keep to the rule above has all of it in "message".
std::string json_line(std::string_view payload, std::string_view level, std::chrono::system_clock::time_point time);

std::unique_ptr<spdlog::formatter> make_log_formatter(LogFormat format);

}  // namespace helio
