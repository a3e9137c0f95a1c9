#include "client/report/settings_table.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <set>

#include "client/report/html_text.h"

namespace helio::report {
namespace {

namespace gp = google::protobuf;

constexpr int kMostViews = 16;  // that are printed; a path may have a thousand

// Exactly as it was, with the digits that tell it apart.
std::string scalar_text(const gp::Message& message, const gp::FieldDescriptor& field) {
  const gp::Reflection& read = *message.GetReflection();
  switch (field.cpp_type()) {
    case gp::FieldDescriptor::CPPTYPE_DOUBLE:
      return fmt::format("{}", read.GetDouble(message, &field));
    case gp::FieldDescriptor::CPPTYPE_FLOAT:
      return fmt::format("{}", read.GetFloat(message, &field));
    case gp::FieldDescriptor::CPPTYPE_BOOL:
      return read.GetBool(message, &field) ? "yes" : "no";
    case gp::FieldDescriptor::CPPTYPE_INT32:
      return std::to_string(read.GetInt32(message, &field));
    case gp::FieldDescriptor::CPPTYPE_INT64:
      return std::to_string(read.GetInt64(message, &field));
    case gp::FieldDescriptor::CPPTYPE_UINT32:
      return std::to_string(read.GetUInt32(message, &field));
    case gp::FieldDescriptor::CPPTYPE_UINT64:
      return std::to_string(read.GetUInt64(message, &field));
    case gp::FieldDescriptor::CPPTYPE_STRING:
      return read.GetString(message, &field);
    case gp::FieldDescriptor::CPPTYPE_ENUM: {
      const gp::EnumValueDescriptor* value = field.enum_type()->FindValueByNumber(read.GetEnumValue(message, &field));
      return value ? std::string(value->name()) : std::to_string(read.GetEnumValue(message, &field));
    }
    default:
      return {};
  }
}

using Fields = std::map<std::string, std::string>;  // by path

// Fields that are set, those of parts behind their path. Repeated fields have none here: settings have none.
void flatten(const gp::Message& message, const std::string& prefix, std::vector<std::string>& order, Fields& out) {
  std::vector<const gp::FieldDescriptor*> set;
  message.GetReflection()->ListFields(message, &set);
  for (const gp::FieldDescriptor* field : set) {
    if (field->is_repeated()) continue;
    const std::string path = prefix + std::string(field->name());
    if (field->cpp_type() == gp::FieldDescriptor::CPPTYPE_MESSAGE) {
      flatten(message.GetReflection()->GetMessage(message, field), path + ".", order, out);
      continue;
    }
    if (std::find(order.begin(), order.end(), path) == order.end()) order.push_back(path);
    out[path] = scalar_text(message, *field);
  }
}

std::string table(const std::string& caption, const std::vector<std::string>& columns,
                  const std::vector<const gp::Message*>& messages, bool mark_differences) {
  std::vector<std::string> order;
  std::vector<Fields> all(messages.size());
  for (std::size_t i = 0; i < messages.size(); ++i) flatten(*messages[i], "", order, all[i]);
  order.erase(std::remove(order.begin(), order.end(), "name"), order.end());
  std::string html = "<figure class=\"table\"><figcaption>" + caption +
                     "</figcaption><table class=\"settings\"><thead><tr><th scope=\"col\">field";
  for (const std::string& column : columns) html += "<th scope=\"col\">" + escaped(column);
  html += "<tbody>\n";
  for (const std::string& path : order) {
    std::set<std::string> different;
    std::string cells;
    for (const Fields& fields : all) {
      const auto found = fields.find(path);
      const std::string text = found == fields.end() ? "–" : found->second;
      different.insert(text);
      cells += "<td>" + escaped(text);
    }
    html += fmt::format("<tr{}><th scope=\"row\">{}{}\n",
                        mark_differences && different.size() > 1 ? " class=\"differs\"" : "", escaped(path), cells);
  }
  return html + "</table></figure>\n";
}

}  // namespace

std::string settings_table(const ReportData& data) {
  const pb::CompareRequest& request = data.request();
  std::vector<std::string> names;
  std::vector<const gp::Message*> messages;
  for (const pb::CompareMode& mode : request.modes()) {
    names.push_back(mode.name());
    messages.push_back(&mode);
  }
  std::string html;
  if (!messages.empty()) {
    html += table(
        "<strong>Complete settings</strong> by the fields of the protocol; rows in which modes differ are marked, and "
        "fields that are 0 stand as –.",
        names, messages, true);
  }
  if (request.reference().has_rendered()) {
    html += table("<strong>Rendered reference</strong>", {"value"}, {&request.reference().rendered()}, false);
  }
  names.clear();
  messages.clear();
  for (int i = 0; i < std::min(kMostViews, request.views_size()); ++i) {
    names.push_back("view " + std::to_string(i));
    messages.push_back(&request.views(i));
  }
  if (!messages.empty()) {
    const bool all = request.views_size() <= kMostViews;
    html += table(all ? "<strong>Views</strong>"
                      : fmt::format("<strong>Views</strong> The first {} of {}; the record has all.", kMostViews,
                                    request.views_size()),
                  names, messages, false);
  }
  names.clear();
  messages.clear();
  for (const pb::CompareRegion& region : request.regions()) {
    names.push_back(region.name());
    messages.push_back(&region);
  }
  if (!messages.empty()) html += table("<strong>Regions</strong>, in pixels", names, messages, false);
  return html;
}

}  // namespace helio::report
