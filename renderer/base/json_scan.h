// A walk over JSON text that builds no tree: what looks at a text before it is trusted overrides what it needs.
#pragma once

#include <nlohmann/json.hpp>

namespace helio {

// Accepts everything; a false from any function ends the walk.
struct JsonScan : nlohmann::json_sax<nlohmann::json> {
  using json = nlohmann::json;

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(json::number_integer_t) override { return true; }
  bool number_unsigned(json::number_unsigned_t) override { return true; }
  bool number_float(json::number_float_t, const json::string_t&) override { return true; }
  bool string(json::string_t&) override { return true; }
  bool binary(json::binary_t&) override { return true; }
  bool start_object(std::size_t) override { return true; }
  bool key(json::string_t&) override { return true; }
  bool end_object() override { return true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
};

}  // namespace helio
