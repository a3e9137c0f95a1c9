#include "client/enum_names.h"

#include <cctype>

namespace helio {

namespace {

constexpr const char* kUnspecified = "UNSPECIFIED";

// Length of "MODE_" for an enumeration whose zero value is MODE_UNSPECIFIED; 0 when it has no such value.
std::size_t prefix_length(const google::protobuf::EnumDescriptor& type) {
  const auto* zero = type.FindValueByNumber(0);
  const std::size_t at = zero ? zero->name().rfind(kUnspecified) : std::string::npos;
  return at == std::string::npos ? 0 : at;
}

}  // namespace

std::string short_name(const google::protobuf::EnumValueDescriptor& value) {
  if (value.name() == "INTEGRATOR_PT_BDPT") return "pt+bdpt";
  std::string name = value.name().substr(prefix_length(*value.type()));
  for (char& c : name) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

std::vector<std::string> short_names(const google::protobuf::EnumDescriptor& type) {
  std::vector<std::string> names;
  for (int i = 0; i < type.value_count(); ++i) {
    if (type.value(i)->number() != 0) names.push_back(short_name(*type.value(i)));
  }
  return names;
}

std::optional<int> enum_number(const google::protobuf::EnumDescriptor& type, const std::string& name) {
  for (int i = 0; i < type.value_count(); ++i) {
    if (type.value(i)->number() != 0 && short_name(*type.value(i)) == name) return type.value(i)->number();
  }
  return std::nullopt;
}

}  // namespace helio
