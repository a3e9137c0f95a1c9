// Records of the state folder as bytes: protobuf messages, between a version and a checksum.
//
// A record: its version, 4 bytes; the message; a CRC-32 of both, 4 bytes. Numbers are little-endian. Messages, because
// they are destroyed without an allocation, which might fail.
#pragma once

#include <google/protobuf/message_lite.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

// version: 2 to 100. 1 is that of the records before this form, which were JSON or CBOR: they are told by their first
// byte. std::length_error: the message is larger than protobuf allows (2 GiB).
std::vector<std::uint8_t> seal(const google::protobuf::MessageLite& message, std::uint32_t version);

// Reads what seal() has made. internal, as the rest of a sentence about the record: the bytes are damaged ("is damaged:
// its checksum is another") or of another version ("has version 1; this program reads version 2"). Memory that the
// message takes grows with the bytes that are there, whatever lengths they claim.
Status unseal(std::span<const std::uint8_t> bytes, std::uint32_t version, google::protobuf::MessageLite& message);
Status unseal(const std::string& bytes, std::uint32_t version, google::protobuf::MessageLite& message);

}  // namespace helio
