#include "client/scene_upload.h"

#include <fstream>

#include "renderer/codec/sha256.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

constexpr std::size_t kChunkBytes = 1 << 20;  // the protocol's largest

Error changed(const std::string& path) {
  return {ErrorCode::internal, "changed while it was uploaded", path};
}

}  // namespace

Status write_scene(grpc::ClientWriterInterface<pb::LoadSceneRequest>& call, const LocalScene& scene,
                   const SceneLoadRequest& request) {
  const std::uint64_t total = scene.total_bytes();
  if (total == 0) return Error{ErrorCode::invalid_argument, "the file is empty", scene.main_file};
  pb::LoadSceneRequest message;
  pb::LoadSceneRequest::Begin& begin = *message.mutable_begin();
  begin.set_main_file(scene.main_file);
  begin.set_time_s(request.time_s);
  begin.set_animation(request.animation);
  begin.set_strict(request.strict);
  begin.set_environment(scene.environment);
  begin.set_total_bytes(total);
  if (!call.Write(message)) return ok_status();

  std::uint64_t sent = 0;
  for (const LocalSceneFile& file : scene.files) {
    const Result<FileHash> hash = hash_file(file.path);
    if (!hash) return hash.error();
    if (hash->bytes != file.bytes) return changed(file.path);
    pb::LoadSceneRequest::BeginFile& begin_file = *message.mutable_begin_file();
    begin_file.set_name(file.name);
    begin_file.set_bytes(file.bytes);
    begin_file.set_sha256(hash->sha256.data(), hash->sha256.size());
    if (!call.Write(message)) return ok_status();

    std::ifstream stream(file.path, std::ios::binary);
    std::uint64_t left = file.bytes;
    while (left > 0) {
      std::string& chunk = *message.mutable_data();
      chunk.resize(std::min<std::uint64_t>(left, kChunkBytes));
      if (!stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size()))) return changed(file.path);
      left -= chunk.size();
      sent += chunk.size();
      if (!call.Write(message)) return ok_status();
      if (request.uploaded) request.uploaded(sent, total);
    }
  }
  return ok_status();
}

}  // namespace helio
