// How the scenes of durable jobs can be loaded again after a restart: uploads are kept as files by their SHA-256,
// scenes from disk by the paths and hashes of their files, edits as the values that they came to.
//
//   FOLDER/blobs/SHA256     a file of an upload
//   FOLDER/recipes/SCENE    how the scene is loaded, as long as a job needs it
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/load/scene_edit.h"
#include "server/base/memory_account.h"
#include "server/scenes/scene_registry.h"

namespace helio {

struct SceneRecipe;

// Thread safe. Calls may take as long as the disk does.
class SceneStore {
 public:
  // max_bytes: of the blobs together. When it is reached, those go that no recipe needs, the longest unused first.
  SceneStore(std::string folder, std::uint64_t max_bytes) : folder_(std::move(folder)), max_bytes_(max_bytes) {}

  struct Held {
    std::string job_id, scene_id;
  };
  // `jobs`: those of earlier processes that may still run; recipes that none of them needs are removed. unavailable:
  // the folder cannot be made or read.
  Status open(std::span<const Held> jobs);

  // Keeps an upload's files, each once. They are on the disk after hold() only. resource_exhausted: they do not fit
  // into max_state_scene_bytes beside those that recipes need; unavailable: the disk.
  Status keep_upload(const SceneBundle& bundle);
  // Writes the recipe of a scene that a job is about to use and flushes all that it needs to the disk. Costs no access
  // to the disk when another job holds the scene already. failed_precondition: the upload's files are not kept;
  // unavailable: the disk.
  Status hold(const LoadedScene& scene, const std::string& job_id);
  // The job is forgotten or at its end.
  void release(const std::string& job_id);

  struct Recipe {
    SceneRequest request;   // loads the scene that was edited, or the scene itself
    std::string loaded_id;  // its id when nothing has changed: the load reads files after this has checked them
    SceneChanges changes;   // for SceneRegistry::change(); empty: it was not edited
  };
  // Reads and checks the hash of every file. An upload's bytes are reserved from `memory`. not_found: there is no
  // recipe; failed_precondition: names the first file that is gone or has changed; internal: the recipe is damaged;
  // resource_exhausted: max_memory.
  Result<Recipe> recipe(const std::string& scene_id, MemoryAccount& memory) const;
  std::uint64_t bytes() const;  // of the blobs

 private:
  struct Blob {
    std::uint64_t bytes = 0;
    std::uint64_t last_use = 0;  // the larger the later
    int needed = 0;              // number of recipes and of calls under way that need it
    bool whole = false;          // this process wrote it or found its hash right
    bool flushed = false;        // to the disk, for a recipe
  };

  std::string blob_file(const std::string& sha256) const { return folder_ + "/blobs/" + sha256; }
  std::string recipe_file(const std::string& scene_id) const { return folder_ + "/recipes/" + scene_id; }
  Status read_folder(std::span<const Held> jobs);
  Result<SceneBundle> read_upload(const SceneRecipe& recipe, MemoryAccount& memory) const;
  Status flush(const std::vector<std::string>& blobs);
  // These with mutex_ held.
  bool add_holder(const std::string& scene_id, const std::string& job_id);
  void need(const std::vector<std::string>& blobs, int more);
  Status make_room(std::uint64_t bytes);

  const std::string folder_;
  const std::uint64_t max_bytes_;
  std::mutex writing_;  // held while recipes are written and removed; to be locked before mutex_
  mutable std::mutex mutex_;
  mutable std::map<std::string, Blob> blobs_;  // by SHA-256, hexadecimal
  std::uint64_t bytes_ = 0;                    // of all blobs
  std::uint64_t uses_ = 0;
  std::map<std::string, std::set<std::string>> holders_;  // by scene: the jobs that hold it
  std::map<std::string, std::vector<std::string>> recipes_;  // by scene: the blobs of its recipe
};

}  // namespace helio
