// Puts an uploaded scene together from the messages of LoadScene, and refuses what does not fit together.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "heliograph/v1/render_service.pb.h"
#include "renderer/base/result.h"
#include "renderer/codec/sha256.h"
#include "renderer/scene/load/scene_loader.h"
#include "server/base/memory_account.h"

namespace helio {

struct SceneBundle {
  std::string main_file;
  std::vector<NamedFile> files;
  std::map<std::string, Sha256Digest> digests;
  Reservation memory;  // for the bytes of `files`
};

// begin, then for each file begin_file and its data. Every error is final: the receiver takes nothing more.
class BundleReceiver {
 public:
  static constexpr std::size_t kMaxChunk = 1 << 20;
  static constexpr std::size_t kMaxName = 4096;
  static constexpr std::size_t kMaxFiles = 65536;

  BundleReceiver(std::uint64_t max_scene_bytes, MemoryAccount& memory)
      : max_scene_bytes_(max_scene_bytes), memory_(memory) {}

  // What is wrong with the fields of an upload's begin.
  void check(const heliograph::v1::LoadSceneRequest::Begin& message, Problems& problems) const;
  // Reserves total_bytes. resource_exhausted names max_scene_bytes or max_memory. Precondition: check() found nothing.
  Status begin(const heliograph::v1::LoadSceneRequest::Begin& message);
  Status begin_file(const heliograph::v1::LoadSceneRequest::BeginFile& message);
  Status data(const std::string& chunk);
  // The whole bundle; invalid_argument when something is missing.
  Result<SceneBundle> finish();

 private:
  Status finish_file();

  const std::uint64_t max_scene_bytes_;
  MemoryAccount& memory_;
  SceneBundle bundle_;
  std::uint64_t total_bytes_ = 0, announced_bytes_ = 0;
  // The file in hand.
  bool file_open_ = false;
  std::uint64_t file_bytes_ = 0;
  std::string file_sha256_;
  std::optional<Sha256> hash_;
};

// Adds a problem when `name` is not a relative path of 1 to 4096 bytes, '/'-separated, without "." and ".." components.
void check_bundle_name(const std::string& name, const std::string& where, Problems& problems);

}  // namespace helio
