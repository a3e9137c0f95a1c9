#include "server/web/protocol_table.h"

#include <google/protobuf/descriptor.h>

#include <nlohmann/json.hpp>

#include "heliograph/v1/web.pb.h"

namespace helio {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using Json = nlohmann::json;

struct Table {
  Json messages = Json::object(), enums = Json::object();

  void add(const EnumDescriptor& type) {
    Json values = Json::object();
    for (int i = 0; i < type.value_count(); ++i) values[std::string(type.value(i)->name())] = type.value(i)->number();
    enums[std::string(type.full_name())] = std::move(values);
  }

  void add(const Descriptor& type) {
    const std::string name(type.full_name());
    if (messages.contains(name)) return;
    messages[name] = Json::array();
    Json fields = Json::array();
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      Json of, oneof;  // null
      if (const Descriptor* message = field.message_type()) {
        of = std::string(message->full_name());
        add(*message);
      } else if (const EnumDescriptor* values = field.enum_type()) {
        of = std::string(values->full_name());
        add(*values);
      }
      if (const auto* group = field.containing_oneof()) oneof = std::string(group->name());
      fields.push_back({field.number(), std::string(field.name()), int(field.type()), field.is_repeated() ? 1 : 0,
                        std::move(of), std::move(oneof)});
    }
    messages[name] = std::move(fields);
  }
};

}  // namespace

std::string protocol_table() {
  Table table;
  table.add(*heliograph::v1::WebRequest::descriptor());
  table.add(*heliograph::v1::WebResponse::descriptor());
  return Json{{"messages", std::move(table.messages)}, {"enums", std::move(table.enums)}}.dump();
}

}  // namespace helio
