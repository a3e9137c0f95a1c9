#include "server/base/read_enum.h"

#include <spdlog/fmt/fmt.h>

namespace helio {

std::string enum_text(const google::protobuf::EnumDescriptor& type, int value) {
  const google::protobuf::EnumValueDescriptor* known = type.FindValueByNumber(value);
  return known ? fmt::format("{} ({})", known->name(), value) : std::to_string(value);
}

int read_enum_number(const google::protobuf::EnumDescriptor& type, int value, int fallback, const std::string& where,
                     Problems& problems) {
  if (value == 0) return fallback;
  if (type.FindValueByNumber(value)) return value;
  std::string allowed;
  for (int i = 0; i < type.value_count(); ++i) {
    if (const int number = type.value(i)->number(); number != 0) allowed += enum_text(type, number) + ", ";
  }
  problems.add(where, fmt::format("unknown value {}; allowed: {}or 0 for {}", value, allowed,
                                  type.FindValueByNumber(fallback)->name()));
  return fallback;
}

void check_constant_enum(const google::protobuf::EnumDescriptor& type, int value, int constant,
                         const std::string& where, Problems& problems) {
  if (value != 0 && value != constant)
    add_constant_problem(enum_text(type, value), enum_text(type, constant) + ", or 0", where, problems);
}

void add_constant_problem(const std::string& value, const std::string& constant, const std::string& where,
                          Problems& problems) {
  problems.add(where, fmt::format("{}; allowed: {} (no longer a choice)", value, constant));
}

}  // namespace helio
