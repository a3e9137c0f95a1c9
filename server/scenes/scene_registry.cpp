#include "server/scenes/scene_registry.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>

#include "renderer/base/clock.h"
#include "renderer/scene/images/environment.h"
#include "renderer/trace/scene/edit_scene.h"

namespace helio {
namespace {

// Passes reads on, remembering the digest of each file, and holds all of them together to max_scene_bytes.
class RecordingSource final : public FileSource {
 public:
  RecordingSource(std::unique_ptr<FileSource> files, std::uint64_t max_scene_bytes)
      : files_(std::move(files)), max_scene_bytes_(max_scene_bytes) {}

  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    const std::uint64_t left = max_scene_bytes_ - std::min(read_bytes_, max_scene_bytes_);
    auto bytes = files_->read(path, std::min(max_bytes, left));
    if (!bytes) {
      if (bytes.error().code == ErrorCode::resource_exhausted && left < max_bytes) {
        return Error{ErrorCode::resource_exhausted,
                     fmt::format("max_scene_bytes: the scene's files are larger than {} bytes", max_scene_bytes_),
                     std::string(path)};
      }
      return bytes;
    }
    read_bytes_ += bytes->size();
    Sha256 hash;
    hash.update(*bytes);
    digests_[std::string(path)] = hash.finish();
    return bytes;
  }

  const std::map<std::string, Sha256Digest>& digests() const { return digests_; }

 private:
  std::unique_ptr<FileSource> files_;
  std::uint64_t max_scene_bytes_;
  mutable std::uint64_t read_bytes_ = 0;
  mutable std::map<std::string, Sha256Digest> digests_;
};

Error cancelled() {
  return {ErrorCode::cancelled, "the load was cancelled", {}};
}

// invalid_argument: a number of something that the scene does not have.
Status check_numbers(const SceneDescription& scene, const SceneChanges& changes) {
  Problems problems;
  const auto check = [&](const auto& changed, std::size_t count, const char* what) {
    if (changed.empty() || changed.rbegin()->first < count) return;
    problems.add(fmt::format("changes.{}", what),
                 fmt::format("number {}; the scene has {}", changed.rbegin()->first, count));
  };
  check(changes.transforms, scene.instances.size(), "transforms");
  check(changes.materials, scene.materials.size(), "materials");
  check(changes.lights, scene.lights.size(), "lights");
  if (changes.environment && !scene.environment) problems.add("changes.environment", "the scene has no environment");
  if (!problems.empty()) return problems.to_error();
  return ok_status();
}

Error no_scene(const std::string& id, const std::string& where) {
  return {ErrorCode::not_found, "there is no scene '" + id + "'", where};
}

}  // namespace

Result<bool> names_environment_file(const std::string& environment) {
  if (environment.empty()) return false;
  std::vector<Image> none;
  const auto parsed = parse_environment(environment, nullptr, 0, none);
  if (parsed) return false;
  if (parsed.error().code == ErrorCode::failed_precondition) return true;
  return parsed.error();
}

std::string SceneManifest::id() const {
  Sha256 hash;
  const auto add = [&](std::string_view text) {
    hash.update(std::to_string(text.size()) + ":");
    hash.update(text);
  };
  add("heliograph scene 2");
  add(main_file);
  add(std::to_string(std::bit_cast<std::uint64_t>(time_s)));
  add(environment);
  add("0");  // a texture filter, when there was a choice: ids stay as they were
  if (!animation.empty()) {
    add("animation");
    add(animation);
  }
  for (const auto& [name, digest] : files) {
    add(name);
    hash.update(digest);
  }
  return to_hex(hash.finish());
}

// A scene on its way, which counts against max_scenes as those that are there do.
class SceneRegistry::Place {
 public:
  explicit Place(SceneRegistry& registry) : registry_(&registry) { ++registry.arriving_; }  // with mutex_ held
  Place(Place&& other) noexcept : registry_(std::exchange(other.registry_, nullptr)) {}
  Place& operator=(Place&&) = delete;
  ~Place() {
    if (!registry_) return;
    const std::lock_guard lock(registry_->mutex_);
    --registry_->arriving_;
  }

  // The scene has come: with mutex_ held.
  void arrive() && { --std::exchange(registry_, nullptr)->arriving_; }

 private:
  SceneRegistry* registry_;
};

// One load: opens the sources, reads, builds.
class SceneRegistry::Load {
 public:
  Load(SceneRegistry& registry, SceneRequest request) : registry_(registry), request_(std::move(request)) {}

  Status open() {
    const auto environment_is_file = names_environment_file(request_.environment);
    if (!environment_is_file) return environment_is_file.error();
    manifest_.time_s = request_.time_s;
    manifest_.animation = request_.animation;
    manifest_.environment = request_.environment;
    environment_ = request_.environment;
    if (auto* bundle = std::get_if<SceneBundle>(&request_.files)) {
      manifest_.main_file = bundle->main_file;
      manifest_.files = bundle->digests;
      bundle_memory_ = std::move(bundle->memory);
      files_ = record(make_memory_source(std::move(bundle->files)));
      return ok_status();
    }
    auto main = registry_.roots_.find(std::get<std::string>(request_.files), "begin.path");
    if (!main) return main.error();
    manifest_.main_file = main->relative;
    files_ = record(make_directory_source(main->root));
    root_ = main->root;
    if (*environment_is_file) {
      auto map = registry_.roots_.find(request_.environment, "begin.environment");
      if (!map) return map.error();
      environment_ = map->relative;
      environment_root_ = map->root;
      environment_files_ = record(make_directory_source(map->root));
    }
    return ok_status();
  }

  // Known before loading for uploads only.
  const SceneManifest& manifest() const { return manifest_; }

  Result<std::shared_ptr<LoadedScene>> run(const CancelToken& cancel) {
    if (cancel.cancelled()) return cancelled();
    const double start = now_s();
    SceneLoadOptions options;
    options.time_s = request_.time_s;
    options.animation = request_.animation;
    options.strict = request_.strict;
    options.max_memory_bytes = std::min(registry_.limits_.max_scene_memory, registry_.memory_.obtainable());
    options.ledger = &reserved_;
    options.environment = environment_;
    options.environment_source = environment_files_ ? environment_files_.get() : files_.get();
    auto description = load_scene(*files_, manifest_.main_file, options);
    if (!description) return description.error();
    if (cancel.cancelled()) return cancelled();

    auto scene = std::make_shared<LoadedScene>();
    scene->load_seconds = now_s() - start;
    RenderSceneOptions build;
    build.threads = registry_.limits_.build_threads;
    build.cancel = &cancel;
    build.ledger = &reserved_;
    auto snapshot = RenderScene::build(std::move(*description), build);
    if (!snapshot) return snapshot.error();
    if (cancel.cancelled()) return cancelled();
    auto counted = registry_.count(std::move(*snapshot), reserved_);
    if (!counted) return counted.error();
    scene->snapshot = std::move(*counted);
    scene->report = scene->snapshot->description().report;
    record_files(*scene);
    scene->id = manifest_.id();
    scene->manifest = manifest_;
    return scene;
  }

 private:
  std::unique_ptr<RecordingSource> record(std::unique_ptr<FileSource> source) const {
    return std::make_unique<RecordingSource>(std::move(source), registry_.limits_.max_scene_bytes);
  }

  void record_files(LoadedScene& scene) {
    if (root_.empty()) return;  // an upload counts as a whole, whatever of it was read
    const auto add = [&](const RecordingSource& source, const std::string& root, const std::string& prefix) {
      for (const auto& [name, digest] : source.digests()) {
        manifest_.files[prefix + name] = digest;
        scene.disk_files[(std::filesystem::path(root) / name).string()] = digest;
      }
    };
    add(*files_, root_, "");
    scene.disk_main_file = (std::filesystem::path(root_) / manifest_.main_file).string();
    if (environment_files_) add(*environment_files_, environment_root_, "environment/");
  }

  SceneRegistry& registry_;
  SceneRequest request_;
  SceneManifest manifest_;
  std::string root_, environment_root_;
  std::string environment_;  // as the loader is to read it
  std::unique_ptr<RecordingSource> files_, environment_files_;
  Reservation bundle_memory_;
  GrowingReservation reserved_{registry_.memory_, MemoryOwner::scenes};
};

Result<SceneRegistry::Outcome> SceneRegistry::load(SceneRequest request, const CancelToken& cancel) {
  request.strict |= limits_.strict;
  // A scene with slips is loaded once more for a strict request, so that the error names them all.
  const bool strict = request.strict;
  const auto serves = [strict](const std::shared_ptr<const LoadedScene>& scene) {
    return scene && !(strict && scene->report.slips > 0);
  };
  if (const auto* path = std::get_if<std::string>(&request.files)) {
    if (auto scene = find_unchanged(*path, request); serves(scene)) return Outcome{std::move(scene), true};
  }
  Load load(*this, std::move(request));
  if (const Status opened = load.open(); !opened.ok()) return opened.error();
  if (!load.manifest().files.empty()) {
    if (auto scene = find(load.manifest().id()); serves(scene)) return Outcome{std::move(scene), true};
  }
  auto place = make_room();
  if (!place) return place.error();
  auto scene = load.run(cancel);
  if (!scene) return scene.error();
  return keep(std::move(*scene), std::move(*place));
}

Result<SceneRegistry::Outcome> SceneRegistry::edit(const SceneLease& base, std::span<const SceneEdit> edits,
                                                   const CancelToken& cancel) {
  auto changes = resolve_edits(base->snapshot->description(), edits);
  if (!changes) return changes.error();
  return change(base, *changes, cancel);
}

Result<SceneRegistry::Outcome> SceneRegistry::change(const SceneLease& base, const SceneChanges& changes,
                                                     const CancelToken& cancel) {
  if (const Status fits = check_numbers(base->snapshot->description(), changes); !fits.ok()) return fits.error();
  auto scene = std::make_shared<LoadedScene>();
  scene->changes = merge_changes(base->changes, changes);
  const std::string& loaded_id = base->edited_from.empty() ? base->id : base->edited_from;
  // Without a change it is what was loaded, whether that is still held or not.
  if (!scene->changes.empty()) scene->edited_from = loaded_id;
  scene->id = edited_scene_id(loaded_id, scene->changes);
  if (auto found = find(scene->id)) return Outcome{std::move(found), true};
  auto place = make_room();
  if (!place) return place.error();

  GrowingReservation reserved(memory_, MemoryOwner::scenes);
  EditOptions options;
  options.threads = limits_.build_threads;
  options.max_bytes = std::min(limits_.max_scene_memory, memory_.obtainable());
  options.ledger = &reserved;
  options.cancel = &cancel;
  auto snapshot = edit_scene(base->snapshot, changes, options);
  if (snapshot) snapshot = count(std::move(*snapshot), reserved);
  if (!snapshot) return snapshot.error();
  scene->snapshot = std::move(*snapshot);
  scene->manifest = base->manifest;
  scene->disk_files = base->disk_files;
  scene->disk_main_file = base->disk_main_file;
  scene->report = scene->snapshot->description().report;
  return keep(std::move(scene), std::move(*place));
}

std::string edited_scene_id(const std::string& loaded_id, const SceneChanges& changes) {
  if (changes.empty()) return loaded_id;
  std::string text = "heliograph edit 1 " + loaded_id;
  const auto add = [&](double value) { text += fmt::format(" {:x}", std::bit_cast<std::uint64_t>(value + 0.0)); };
  const auto add_colour = [&](const Rgb& c) {
    for (int i = 0; i < 3; ++i) add(double(c[i]));
  };
  for (const auto& [index, change] : changes.transforms) {
    text += fmt::format(" object {}", index);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 3; ++j) add(change.to[i][j]);
    }
  }
  for (const auto& [index, change] : changes.materials) {
    text += fmt::format(" material {}", index);
    add_colour(change.to.base_color);
    add_colour(change.to.emission);
    add(double(change.to.roughness));
  }
  for (const auto& [index, change] : changes.lights) {
    text += fmt::format(" light {}", index);
    add_colour(change.to);
  }
  if (changes.environment) {
    text += " environment";
    add_colour(changes.environment->to);
  }
  Sha256 hash;
  hash.update(text);
  return to_hex(hash.finish());
}

Result<std::shared_ptr<const RenderScene>> SceneRegistry::count(std::shared_ptr<const RenderScene> snapshot,
                                                                GrowingReservation& reserved) {
  struct Counted {
    std::vector<std::shared_ptr<const Reservation>> memory;  // released after the snapshot
    std::shared_ptr<const RenderScene> snapshot;
  };
  auto counted = std::make_shared<Counted>();
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(shares_, [](const auto& entry) { return entry.second.expired(); });
    for (const MemoryShare& share : snapshot->memory()) {
      auto& known = shares_[share.what.get()];
      auto reservation = known.lock();
      if (!reservation) {
        auto fresh = reserved.split(share.bytes, "the scene");
        if (!fresh) return fresh.error();
        known = reservation = std::make_shared<const Reservation>(std::move(*fresh));
      }
      counted->memory.push_back(std::move(reservation));
    }
  }
  counted->snapshot = std::move(snapshot);
  const RenderScene* scene = counted->snapshot.get();
  return std::shared_ptr<const RenderScene>(std::move(counted), scene);
}

Result<SceneRegistry::Place> SceneRegistry::make_room() {
  do {
    const std::lock_guard lock(mutex_);
    if (scenes_.size() + std::size_t(arriving_) < std::size_t(limits_.max_scenes)) return Place(*this);
  } while (evict_edited());
  return Error{ErrorCode::resource_exhausted,
               fmt::format("max_scenes: {} scenes are loaded, as many as are allowed", limits_.max_scenes),
               {}};
}

bool SceneRegistry::evict_edited() {
  std::shared_ptr<const LoadedScene> evicted;  // destroyed outside the lock
  const std::lock_guard lock(mutex_);
  auto oldest = scenes_.end();
  for (auto it = scenes_.begin(); it != scenes_.end(); ++it) {
    if (!evictable(*it->second)) continue;
    if (oldest == scenes_.end() || it->second->last_use < oldest->second->last_use) oldest = it;
  }
  if (oldest == scenes_.end()) return false;
  evicted = std::move(oldest->second);
  scenes_.erase(oldest);
  return true;
}

std::uint64_t SceneRegistry::evictable_bytes() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = 0;
  for (const auto& [id, scene] : scenes_) {
    if (evictable(*scene)) bytes += scene->snapshot->stats().own_bytes;
  }
  return bytes;
}

Result<SceneRegistry::Outcome> SceneRegistry::keep(std::shared_ptr<LoadedScene> scene, Place place) {
  const std::lock_guard lock(mutex_);
  std::move(place).arrive();
  touch(*scene);
  const auto [held, inserted] = scenes_.try_emplace(scene->id, scene);
  return Outcome{held->second, !inserted};
}

std::shared_ptr<const LoadedScene> SceneRegistry::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = scenes_.find(id);
  if (found == scenes_.end()) return nullptr;
  touch(*found->second);
  return found->second;
}

Result<std::shared_ptr<const LoadedScene>> SceneRegistry::find(const std::string& id, const std::string& where) const {
  auto scene = find(id);
  if (!scene) return no_scene(id, where);
  return scene;
}

// A scene loaded from this path with the same options, all of whose files still have the same bytes.
std::shared_ptr<const LoadedScene> SceneRegistry::find_unchanged(const std::string& path,
                                                                 const SceneRequest& request) const {
  const auto location = roots_.find(path, "begin.path");
  if (!location) return nullptr;
  const std::string main = (std::filesystem::path(location->root) / location->relative).string();
  for (auto& scene : list()) {
    if (!scene->edited_from.empty()) continue;
    const SceneManifest& manifest = scene->manifest;
    if (manifest.time_s != request.time_s || manifest.animation != request.animation ||
        manifest.environment != request.environment) {
      continue;
    }
    if (scene->disk_main_file != main) continue;
    if (std::all_of(scene->disk_files.begin(), scene->disk_files.end(), [](const auto& file) {
          const auto hash = hash_file(file.first);
          return hash && hash->sha256 == file.second;
        })) {
      return scene;
    }
  }
  return nullptr;
}

Result<SceneLease> SceneRegistry::acquire(const std::string& id, const std::string& where) const {
  const std::lock_guard lock(mutex_);
  const auto found = scenes_.find(id);
  if (found == scenes_.end()) return no_scene(id, where);
  touch(*found->second);
  return SceneLease(found->second);
}

Status SceneRegistry::unload(const std::string& id, const std::string& where) {
  std::shared_ptr<const LoadedScene> unloaded;  // destroyed outside the lock
  const std::lock_guard lock(mutex_);
  const auto found = scenes_.find(id);
  if (found == scenes_.end()) return no_scene(id, where);
  if (const int references = found->second->references; references > 0) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("scene '{}' is used by {} sessions and jobs; close them first", id, references), where};
  }
  unloaded = std::move(found->second);
  scenes_.erase(found);
  return ok_status();
}

std::vector<std::shared_ptr<const LoadedScene>> SceneRegistry::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<const LoadedScene>> scenes;
  scenes.reserve(scenes_.size());
  for (const auto& [id, scene] : scenes_) scenes.push_back(scene);
  return scenes;
}

}  // namespace helio
