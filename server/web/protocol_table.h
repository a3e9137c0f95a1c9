// What the page's codec reads: the fields of all messages that it may meet, from the descriptors of this build.
#pragma once

#include <string>

namespace helio {

// JSON: {"messages": {NAME: [[number, name, type, repeated, type name or null, oneof or null], ...]},
// "enums": {NAME: {value name: number}}} of everything that WebRequest and WebResponse reach. `type` is
// FieldDescriptorProto.Type, `repeated` 0 or 1, `oneof` also of proto3's optional fields, which may be absent; names of
// messages and enums in full, of fields as in the .proto.
std::string protocol_table();

}  // namespace helio
