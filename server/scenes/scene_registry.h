// The scenes that the daemon holds: loaded once, shared by every session and job that uses them.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/codec/sha256.h"
#include "renderer/scene/load/scene_edit.h"
#include "renderer/scene/load/scene_loader.h"
#include "renderer/trace/scene/render_scene.h"
#include "server/base/memory_account.h"
#include "server/scenes/scene_bundle.h"
#include "server/scenes/scene_roots.h"

namespace helio {

// What identifies a scene: the files that were read and the options that shaped it.
struct SceneManifest {
  std::string main_file;
  double time_s = 0;
  std::string animation;  // as requested; empty: the first one that moves anything
  std::string environment;
  std::map<std::string, Sha256Digest> files;

  // SHA-256 over all of it, hexadecimal.
  std::string id() const;
};

// The tokens that have loaded or made a scene, by name. Thread safe.
class SceneOwners {
 public:
  void add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (!name.empty()) names_.insert(name);
  }
  std::set<std::string> names() const {
    const std::lock_guard lock(mutex_);
    return names_;
  }

 private:
  mutable std::mutex mutex_;
  std::set<std::string> names_;
};

struct LoadedScene : std::enable_shared_from_this<LoadedScene> {
  std::string id;
  SceneManifest manifest;
  // Files that were read, by absolute path, and the main one of them; of an edited scene, those of the scene that it
  // was edited from. Empty: an upload.
  std::map<std::string, Sha256Digest> disk_files;
  std::string disk_main_file;
  double load_seconds = 0;
  LoadReport report;
  std::shared_ptr<const RenderScene> snapshot;  // counted in the memory account as long as anybody holds it
  std::string edited_from;  // id of the loaded scene that this one was edited from; empty: not edited
  SceneChanges changes;     // all edits relative to that scene
  mutable std::atomic<int> references{0};
  mutable std::atomic<std::uint64_t> last_use{0};  // the registry's use counter at the last acquire
  mutable SceneOwners owners;
};

// What identifies the scene that these changes make of a loaded one.
std::string edited_scene_id(const std::string& loaded_id, const SceneChanges& changes);

// Keeps a scene from being unloaded.
class SceneLease {
 public:
  SceneLease() = default;
  explicit SceneLease(std::shared_ptr<const LoadedScene> scene) : scene_(std::move(scene)) { ++scene_->references; }
  SceneLease(SceneLease&& other) noexcept = default;
  SceneLease& operator=(SceneLease&& other) noexcept {
    release();
    scene_ = std::move(other.scene_);
    return *this;
  }
  ~SceneLease() { release(); }

  const LoadedScene& operator*() const { return *scene_; }
  const LoadedScene* operator->() const { return scene_.get(); }
  const LoadedScene* get() const { return scene_.get(); }

 private:
  void release() {
    if (scene_) --scene_->references;
    scene_.reset();
  }
  std::shared_ptr<const LoadedScene> scene_;
};

struct SceneLimits {
  std::uint64_t max_scene_bytes = 0;
  std::uint64_t max_scene_memory = 0;
  int max_scenes = 0;
  int build_threads = 0;
  bool strict = false;  // every load is
};

struct SceneRequest {
  std::variant<std::string, SceneBundle> files;  // a path under the roots, or an upload
  double time_s = 0;
  std::string animation;
  bool strict = false;      // refuses slips (SceneLoadOptions::strict); does not change what is loaded
  std::string environment;  // "R,G,B" or a file; empty: the scene's own
};

// True: the text names a file. False: it is empty or a colour. invalid_argument: it is neither.
Result<bool> names_environment_file(const std::string& environment);

class SceneRegistry {
 public:
  SceneRegistry(SceneRoots roots, const SceneLimits& limits, MemoryAccount& memory)
      : roots_(std::move(roots)), limits_(limits), memory_(memory) {}

  const SceneRoots& roots() const { return roots_; }

  struct Outcome {
    std::shared_ptr<const LoadedScene> scene;
    bool already_loaded = false;
  };
  // Takes seconds. `cancel` is looked at between the stages. Loads and edits may run side by side. Memory is reserved
  // as the load goes on, each part before it is allocated.
  Result<Outcome> load(SceneRequest request, const CancelToken& cancel);

  // As load(). The edited scene is held until it is unloaded, or until room is needed while nobody uses it: then the
  // one least recently acquired or asked for goes first. Errors: those of resolve_edits() and edit_scene();
  // resource_exhausted (max_scenes, max_memory).
  Result<Outcome> edit(const SceneLease& base, std::span<const SceneEdit> edits, const CancelToken& cancel);
  // The same for changes that edits have come to: relative to `base`, as LoadedScene::changes are to the scene that it
  // was edited from. Errors besides: invalid_argument (a number that the scene does not have).
  Result<Outcome> change(const SceneLease& base, const SceneChanges& changes, const CancelToken& cancel);

  Result<SceneLease> acquire(const std::string& id, const std::string& where) const;
  // Without a lease: it may be unloaded, and lives on for the caller.
  Result<std::shared_ptr<const LoadedScene>> find(const std::string& id, const std::string& where) const;
  Status unload(const std::string& id, const std::string& where);
  std::vector<std::shared_ptr<const LoadedScene>> list() const;

  // Unloads the edited scene that is least recently used; false when all are in use.
  bool evict_edited();
  // Bytes that repeated calls of evict_edited() could free.
  std::uint64_t evictable_bytes() const;

 private:
  class Load;
  std::shared_ptr<const LoadedScene> find(const std::string& id) const;
  std::shared_ptr<const LoadedScene> find_unchanged(const std::string& path, const SceneRequest& request) const;
  class Place;
  Result<Outcome> keep(std::shared_ptr<LoadedScene> scene, Place place);
  // Moves the bytes that the snapshot keeps out of the reservation of its load. Memory that scenes share is reserved
  // once.
  Result<std::shared_ptr<const RenderScene>> count(std::shared_ptr<const RenderScene> snapshot,
                                                   GrowingReservation& reserved);
  bool evictable(const LoadedScene& scene) const { return !scene.edited_from.empty() && scene.references == 0; }
  // Room for one more scene, if need be by evicting one.
  Result<Place> make_room();
  void touch(const LoadedScene& scene) const { scene.last_use = ++uses_; }

  const SceneRoots roots_;
  const SceneLimits limits_;
  MemoryAccount& memory_;

  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const LoadedScene>> scenes_;
  int arriving_ = 0;  // scenes that are being loaded or edited
  std::map<const void*, std::weak_ptr<const Reservation>> shares_;  // by MemoryShare::what
  mutable std::atomic<std::uint64_t> uses_{0};
};

}  // namespace helio
