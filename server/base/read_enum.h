// Enumerations of messages: on the wire they may hold any number.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>

#include "renderer/base/result.h"

namespace helio {

// "MODE_PT (1)", or the number alone where the enumeration has no such value.
std::string enum_text(const google::protobuf::EnumDescriptor& type, int value);
// `value`; `fallback` for 0, and for an unknown number, which is a problem that names all values.
int read_enum_number(const google::protobuf::EnumDescriptor& type, int value, int fallback, const std::string& where,
                     Problems& problems);

template <class Enum>
Enum read_enum(const google::protobuf::EnumDescriptor& type, Enum value, Enum fallback, const std::string& where,
               Problems& problems) {
  return static_cast<Enum>(read_enum_number(type, int(value), int(fallback), where, problems));
}

// A field of former versions that no longer offers a choice: 0, or what is always done now.
void check_constant_enum(const google::protobuf::EnumDescriptor& type, int value, int constant,
                         const std::string& where, Problems& problems);
// The same for any field: `value` is what was sent.
void add_constant_problem(const std::string& value, const std::string& constant, const std::string& where,
                          Problems& problems);

}  // namespace helio
