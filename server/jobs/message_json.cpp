#include "server/jobs/message_json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/zero_copy_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <utility>

namespace helio {
namespace {

namespace io = google::protobuf::io;
namespace util = google::protobuf::util;

constexpr char kTypeUrl[] = "type.googleapis.com";
constexpr std::size_t kFirstBytes = 1024, kMostMoreBytes = std::size_t(1) << 30;  // Next() counts in an int

// A string that text is written to. Where it cannot grow, Next() says so and throws nothing: io::CodedOutputStream has
// written beyond its buffer by then, and its destructor, were it unwound, would end the process.
class GrowingText final : public io::ZeroCopyOutputStream {
 public:
  bool Next(void** data, int* size) override {
    const std::size_t used = text_.size();
    try {
      text_.resize(used + std::clamp(used, kFirstBytes, kMostMoreBytes));
    } catch (const std::exception&) {
      out_of_memory_ = true;
      return false;
    }
    *data = text_.data() + used;
    *size = static_cast<int>(text_.size() - used);
    return true;
  }
  void BackUp(int count) override { text_.resize(text_.size() - static_cast<std::size_t>(count)); }
  std::int64_t ByteCount() const override { return static_cast<std::int64_t>(text_.size()); }

  std::string take() {
    if (out_of_memory_) throw std::bad_alloc();
    return std::move(text_);
  }

 private:
  std::string text_;
  bool out_of_memory_ = false;
};

}  // namespace

Result<std::string> to_json(const google::protobuf::Message& message) {
  const std::unique_ptr<util::TypeResolver> types(
      util::NewTypeResolverForDescriptorPool(kTypeUrl, message.GetDescriptor()->file()->pool()));
  const std::string bytes = message.SerializeAsString();
  io::ArrayInputStream input(bytes.data(), static_cast<int>(bytes.size()));
  util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  GrowingText text;
  const std::string type = std::string(kTypeUrl) + "/" + std::string(message.GetDescriptor()->full_name());
  const auto written = util::BinaryToJsonStream(types.get(), type, &input, &text, options);
  if (!written.ok()) return Error{ErrorCode::internal, written.ToString(), message.GetDescriptor()->name()};
  return text.take();
}

}  // namespace helio
