// Short names of the protocol's enumerations ("MODE_PT" <-> "pt"), read from the protocol itself, so that a mode added
// there is known here.
#pragma once

#include <google/protobuf/descriptor.h>

#include <optional>
#include <string>
#include <vector>

#include "heliograph/v1/types.pb.h"

namespace helio {

namespace pb = heliograph::v1;

// "pt" for MODE_PT: the part after the prefix that all values share with UNSPECIFIED, in lower case, '-' for '_'; of
// INTEGRATOR_PT_BDPT "pt+bdpt".
std::string short_name(const google::protobuf::EnumValueDescriptor& value);

// All short names but that of UNSPECIFIED, in the order of their numbers.
std::vector<std::string> short_names(const google::protobuf::EnumDescriptor& type);

// The number of the value with this short name; none: no such value. UNSPECIFIED is never found.
std::optional<int> enum_number(const google::protobuf::EnumDescriptor& type, const std::string& name);

// Short name of a value; a number that this build does not know is printed as it is.
template <class Enum>
std::string to_short_name(Enum value) {
  const auto* type = google::protobuf::GetEnumDescriptor<Enum>();
  const auto* found = type->FindValueByNumber(static_cast<int>(value));
  return found ? short_name(*found) : std::to_string(static_cast<int>(value));
}

template <class Enum>
std::optional<Enum> from_short_name(const std::string& name) {
  const std::optional<int> number = enum_number(*google::protobuf::GetEnumDescriptor<Enum>(), name);
  if (!number) return std::nullopt;
  return static_cast<Enum>(*number);
}

}  // namespace helio
