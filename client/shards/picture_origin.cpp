#include "client/shards/picture_origin.h"

#include <google/protobuf/util/json_util.h>

#include "renderer/base/check.h"
#include "renderer/codec/tile_codec.h"

namespace helio {

namespace pb = heliograph::v1;
namespace json = google::protobuf::util;

std::string write_origin(const pb::PictureOrigin& origin) {
  json::JsonPrintOptions names;
  names.preserve_proto_field_names = true;
  std::string text;
  HELIO_CHECK(json::MessageToJsonString(origin, &text, names).ok());  // fails for messages of unknown types alone
  return text;
}

Result<pb::PictureOrigin> read_origin(const std::string& text) {
  if (text.empty()) {
    return Error{ErrorCode::invalid_argument, "the file does not say how it was made",
                 std::string("attribute ") + kExrOrigin};
  }
  json::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  pb::PictureOrigin origin;
  const auto read = json::JsonStringToMessage(text, &origin, options);
  if (!read.ok()) {
    return Error{ErrorCode::invalid_argument, "is not a PictureOrigin: " + std::string(read.message()),
                 std::string("attribute ") + kExrOrigin};
  }
  return origin;
}

}  // namespace helio
