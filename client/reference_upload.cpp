#include "client/reference_upload.h"

#include <algorithm>
#include <fstream>

#include "renderer/codec/sha256.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

constexpr std::size_t kChunkBytes = 1 << 20;  // the protocol's largest

}  // namespace

Status write_reference(grpc::ClientWriterInterface<pb::LoadReferenceRequest>& call, const std::string& path,
                       const std::function<void(std::uint64_t, std::uint64_t)>& uploaded) {
  const Result<FileHash> hash = hash_file(path);
  if (!hash) return hash.error();
  if (hash->bytes == 0) return Error{ErrorCode::invalid_argument, "the file is empty", path};
  pb::LoadReferenceRequest message;
  message.mutable_begin()->set_bytes(hash->bytes);
  message.mutable_begin()->set_sha256(hash->sha256.data(), hash->sha256.size());
  if (!call.Write(message)) return ok_status();

  std::ifstream stream(path, std::ios::binary);
  std::uint64_t left = hash->bytes;
  while (left > 0) {
    std::string& chunk = *message.mutable_data();
    chunk.resize(std::min<std::uint64_t>(left, kChunkBytes));
    if (!stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size())))
      return Error{ErrorCode::internal, "changed while it was uploaded", path};
    left -= chunk.size();
    if (!call.Write(message)) return ok_status();
    if (uploaded) uploaded(hash->bytes - left, hash->bytes);
  }
  return ok_status();
}

}  // namespace helio
