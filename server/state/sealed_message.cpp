#include "server/state/sealed_message.h"

#include <spdlog/fmt/fmt.h>

#include <climits>
#include <stdexcept>

#include "renderer/codec/checksum.h"

namespace helio {
namespace {

constexpr std::size_t kNumber = sizeof(std::uint32_t);

void put(std::uint8_t* to, std::uint32_t number) {
  for (std::size_t i = 0; i < kNumber; ++i) to[i] = std::uint8_t(number >> 8 * i);
}

std::uint32_t number_at(const std::uint8_t* from) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < kNumber; ++i) number |= std::uint32_t(from[i]) << 8 * i;
  return number;
}

// A text of JSON that is an object, or a map of CBOR.
bool is_of_version_1(std::span<const std::uint8_t> bytes) {
  return !bytes.empty() && (bytes[0] == '{' || bytes[0] >> 5 == 5);
}

Error error(std::string message) {
  return {ErrorCode::internal, std::move(message), {}};
}

Error other_version(std::uint32_t found, std::uint32_t version) {
  return error(fmt::format("has version {}; this program reads version {}", found, version));
}

}  // namespace

std::vector<std::uint8_t> seal(const google::protobuf::MessageLite& message, std::uint32_t version) {
  const std::size_t size = message.ByteSizeLong();
  if (size > INT_MAX) throw std::length_error(fmt::format("a record of {} bytes; allowed: at most {}", size, INT_MAX));
  std::vector<std::uint8_t> bytes(kNumber + size + kNumber);
  put(bytes.data(), version);
  HELIO_CHECK(message.SerializeToArray(bytes.data() + kNumber, int(size)));
  put(bytes.data() + kNumber + size, crc32_of(bytes.data(), kNumber + size));
  return bytes;
}

Status unseal(std::span<const std::uint8_t> bytes, std::uint32_t version, google::protobuf::MessageLite& message) {
  if (is_of_version_1(bytes)) return other_version(1, version);
  if (bytes.size() < 2 * kNumber) return error(fmt::format("is damaged: it has {} bytes", bytes.size()));
  const auto sealed = bytes.first(bytes.size() - kNumber);
  if (number_at(bytes.data() + sealed.size()) != crc32_of(sealed.data(), sealed.size()))
    return error("is damaged: its checksum is another");
  if (const std::uint32_t found = number_at(bytes.data()); found != version) return other_version(found, version);
  const auto content = sealed.subspan(kNumber);
  if (content.size() > INT_MAX || !message.ParseFromArray(content.data(), int(content.size())))
    return error("is damaged: its message cannot be read");
  return ok_status();
}

Status unseal(const std::string& bytes, std::uint32_t version, google::protobuf::MessageLite& message) {
  return unseal({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, version, message);
}

}  // namespace helio
