#include "server/state/scene_store.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "renderer/codec/atomic_file.h"
#include "server/base/guarded.h"
#include "server/state/scene_recipe.h"

namespace helio {
namespace {

namespace fs = std::filesystem;

// 65536 files with names of 4096 bytes, and what else there is.
constexpr std::uint64_t kMaxRecipe = 512ull << 20;

// A SHA-256 in hexadecimal, as blobs and scenes are called.
bool is_digest(const std::string& name) {
  return name.size() == 64 && name.find_first_not_of("0123456789abcdef") == std::string::npos;
}

Error disk_error(const Error& error) {
  return {ErrorCode::unavailable, error.message, error.where};
}

Result<SceneRecipe> read_recipe_file(const std::string& file) {
  const auto bytes = read_whole_file(file, kMaxRecipe);
  if (!bytes) return bytes.error();
  auto recipe = decode_recipe(*bytes);
  if (!recipe) return Error{recipe.error().code, "the recipe " + recipe.error().message, file};
  return recipe;
}

Sha256Digest sha256_of(std::span<const std::uint8_t> bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

// failed_precondition, unless every file of the scene has the bytes that it had.
Status check_disk_files(const SceneRecipe& recipe) {
  for (const auto& [path, digest] : recipe.files) {
    const auto found = hash_file(path);
    if (!found) {
      return Error{ErrorCode::failed_precondition,
                   "a file of the scene is gone or cannot be read since the job was submitted", path};
    }
    if (found->sha256 != digest) {
      return Error{ErrorCode::failed_precondition,
                   fmt::format("a file of the scene has changed since the job was submitted: its SHA-256 was {} and is "
                               "{}",
                               to_hex(digest), to_hex(found->sha256)),
                   path};
    }
  }
  return ok_status();
}

}  // namespace

Status SceneStore::open(std::span<const Held> jobs) {
  std::error_code failed;
  for (const char* folder : {"/blobs", "/recipes"}) {
    fs::create_directories(folder_ + folder, failed);
    if (failed) return Error{ErrorCode::unavailable, "cannot be made: " + failed.message(), folder_ + folder};
  }
  try {
    return read_folder(jobs);
  } catch (const fs::filesystem_error& error) {
    return Error{ErrorCode::unavailable, error.what(), folder_};
  }
}

Status SceneStore::read_folder(std::span<const Held> jobs) {
  const std::scoped_lock lock(writing_, mutex_);
  std::vector<std::pair<fs::file_time_type, std::string>> by_time;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_ + "/blobs")) {
    const std::string name = entry.path().filename().string();
    if (!is_digest(name)) {
      std::error_code ignored;
      fs::remove(entry.path(), ignored);  // of a write that was interrupted
      continue;
    }
    blobs_[name].bytes = entry.file_size();
    bytes_ += entry.file_size();
    by_time.emplace_back(entry.last_write_time(), name);
  }
  std::sort(by_time.begin(), by_time.end());
  for (const auto& [time, name] : by_time) blobs_[name].last_use = ++uses_;

  for (const Held& held : jobs) holders_[held.scene_id].insert(held.job_id);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_ + "/recipes")) {
    const std::string name = entry.path().filename().string();
    if (!holders_.contains(name)) {
      std::error_code ignored;
      fs::remove(entry.path(), ignored);
      continue;
    }
    const auto recipe = read_recipe_file(entry.path().string());
    if (!recipe) continue;  // recipe() says why
    recipes_[name] = recipe->blobs();
    for (const std::string& blob : recipes_[name]) {
      Blob& entry = blobs_[blob];  // without bytes: it is gone, and needed when an upload brings it again
      ++entry.needed;
      entry.flushed = true;
    }
  }
  return ok_status();
}

void SceneStore::need(const std::vector<std::string>& blobs, int more) {
  for (const std::string& blob : blobs) {
    if (const auto found = blobs_.find(blob); found != blobs_.end()) found->second.needed += more;
  }
}

Status SceneStore::make_room(std::uint64_t bytes) {
  std::uint64_t needed = 0;
  for (const auto& [name, blob] : blobs_) {
    if (blob.needed > 0) needed += blob.bytes;
  }
  if (bytes > max_bytes_ || needed > max_bytes_ - bytes) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_state_scene_bytes: {} bytes of an upload do not fit beside the {} bytes of the "
                             "scenes that jobs need; allowed: {} bytes together",
                             bytes, needed, max_bytes_),
                 {}};
  }
  if (bytes_ <= max_bytes_ - bytes) return ok_status();
  std::vector<std::map<std::string, Blob>::iterator> unneeded;
  for (auto it = blobs_.begin(); it != blobs_.end(); ++it) {
    if (it->second.needed == 0) unneeded.push_back(it);
  }
  std::sort(unneeded.begin(), unneeded.end(),
            [](const auto& a, const auto& b) { return a->second.last_use < b->second.last_use; });
  for (const auto& oldest : unneeded) {
    if (bytes_ <= max_bytes_ - bytes) break;
    std::error_code ignored;
    fs::remove(blob_file(oldest->first), ignored);
    bytes_ -= oldest->second.bytes;
    blobs_.erase(oldest);
  }
  return ok_status();
}

Status SceneStore::keep_upload(const SceneBundle& bundle) {
  std::map<std::string, std::span<const std::uint8_t>> content;  // by SHA-256
  for (const NamedFile& file : bundle.files) content[to_hex(bundle.digests.at(file.path))] = file.bytes;
  std::vector<std::string> all;
  std::map<std::string, Flush> missing;
  {
    const std::lock_guard lock(mutex_);
    std::uint64_t bytes = 0;
    for (const auto& [name, content_bytes] : content) {
      all.push_back(name);
      const auto found = blobs_.find(name);
      if (found != blobs_.end() && found->second.whole) continue;
      // One that a recipe needs has to stay on the disk while it is written anew.
      missing[name] = found != blobs_.end() && found->second.flushed ? Flush::now : Flush::later;
      const std::uint64_t has = found == blobs_.end() ? 0 : found->second.bytes;
      bytes += content_bytes.size() - std::min<std::uint64_t>(content_bytes.size(), has);
    }
    need(all, 1);  // those that are there
    if (const Status room = make_room(bytes); !room.ok()) {
      need(all, -1);
      return room;
    }
    for (const auto& [name, content_bytes] : content) {
      const auto [entry, added] = blobs_.try_emplace(name);
      if (added) entry->second.needed = 1;
      entry->second.last_use = ++uses_;
      if (!missing.contains(name)) continue;
      bytes_ += content_bytes.size() - entry->second.bytes;
      entry->second.bytes = content_bytes.size();
    }
  }
  Status kept = ok_status();
  for (const auto& [name, flush] : missing) {
    kept = guarded([&] { return write_parts_atomically(blob_file(name), {&content[name], 1}, flush); });
    if (!kept.ok()) break;
    const std::lock_guard lock(mutex_);
    blobs_.at(name).whole = true;
  }
  const std::lock_guard lock(mutex_);
  need(all, -1);
  for (const std::string& name : all) {
    const auto found = blobs_.find(name);
    if (found->second.whole) {
      std::error_code ignored;
      if (!missing.contains(name)) fs::last_write_time(blob_file(name), fs::file_time_type::clock::now(), ignored);
    } else if (found->second.needed == 0) {
      std::error_code ignored;
      fs::remove(blob_file(name), ignored);
      bytes_ -= found->second.bytes;
      blobs_.erase(found);
    }
  }
  if (!kept.ok()) return disk_error(kept.error());
  return kept;
}

bool SceneStore::add_holder(const std::string& scene_id, const std::string& job_id) {
  if (!recipes_.contains(scene_id)) return false;
  holders_[scene_id].insert(job_id);
  return true;
}

Status SceneStore::hold(const LoadedScene& scene, const std::string& job_id) {
  {
    const std::lock_guard lock(mutex_);
    if (add_holder(scene.id, job_id)) return ok_status();
  }
  const SceneRecipe recipe = make_recipe(scene);
  const std::vector<std::string> blobs = recipe.blobs();
  const std::lock_guard writing(writing_);
  {
    const std::lock_guard lock(mutex_);
    if (add_holder(scene.id, job_id)) return ok_status();
    for (const auto& [name, digest] : recipe.files) {
      if (!recipe.upload) break;
      const auto found = blobs_.find(to_hex(digest));
      if (found != blobs_.end() && found->second.whole) continue;
      return Error{ErrorCode::failed_precondition,
                   fmt::format("'{}' of the scene's upload is not kept, so that a job could not load the scene again; "
                               "upload it once more (max_state_scene_bytes is {})",
                               name, max_bytes_),
                   {}};
    }
    need(blobs, 1);
  }
  // The rows are made before the file, so that one without a row never lies there.
  std::map<std::string, std::vector<std::string>> recipe_row;
  std::map<std::string, std::set<std::string>> holder_row;
  Status held = guarded([&] {
    recipe_row[scene.id] = blobs;
    holder_row[scene.id].insert(job_id);
    const Status flushed = flush(blobs);
    return flushed.ok() ? write_file_atomically(recipe_file(scene.id), encode_recipe(recipe)) : flushed;
  });
  const std::lock_guard lock(mutex_);
  if (!held.ok()) {
    need(blobs, -1);
    return disk_error(held.error());
  }
  recipes_.merge(recipe_row);
  holders_.merge(holder_row);
  // Jobs that hold it without a recipe have come from the daemon before.
  if (!holder_row.empty()) holders_.find(scene.id)->second.merge(holder_row.begin()->second);
  return ok_status();
}

// With writing_ held.
Status SceneStore::flush(const std::vector<std::string>& blobs) {
  std::vector<std::string> files;
  {
    const std::lock_guard lock(mutex_);
    for (const std::string& blob : blobs) {
      if (!blobs_.at(blob).flushed) files.push_back(blob_file(blob));
    }
  }
  if (const Status flushed = flush_files(files); !flushed.ok()) return flushed;
  const std::lock_guard lock(mutex_);
  for (const std::string& blob : blobs) blobs_.at(blob).flushed = true;
  return ok_status();
}

void SceneStore::release(const std::string& job_id) {
  const std::scoped_lock lock(writing_, mutex_);
  for (auto entry = holders_.begin(); entry != holders_.end();) {
    auto& [scene_id, jobs] = *entry;
    if (!jobs.contains(job_id) || jobs.size() > 1) {
      jobs.erase(job_id);
      ++entry;
      continue;
    }
    // Before anything is taken away: a call that lacked memory is made again.
    const fs::path file = recipe_file(scene_id);
    std::error_code ignored;
    fs::remove(file, ignored);
    if (const auto recipe = recipes_.find(scene_id); recipe != recipes_.end()) {
      need(recipe->second, -1);
      recipes_.erase(recipe);
    }
    entry = holders_.erase(entry);
  }
}

Result<SceneBundle> SceneStore::read_upload(const SceneRecipe& recipe, MemoryAccount& memory) const {
  const auto note = [&](const std::string& blob, bool whole) {
    const std::lock_guard lock(mutex_);
    if (const auto found = blobs_.find(blob); found != blobs_.end()) found->second.whole = whole;
  };
  SceneBundle bundle;
  bundle.main_file = recipe.main_file;
  bundle.digests = recipe.files;
  std::uint64_t total = 0;
  for (const auto& [name, digest] : recipe.files) {
    std::error_code gone;
    const auto size = fs::file_size(blob_file(to_hex(digest)), gone);
    if (gone) {
      note(to_hex(digest), false);
      return Error{ErrorCode::failed_precondition, fmt::format("'{}' of the scene's upload is gone", name),
                   blob_file(to_hex(digest))};
    }
    total += size;
  }
  auto reserved = memory.reserve_with_room(total, "the scene's upload", MemoryOwner::uploads);
  if (!reserved) return reserved.error();
  bundle.memory = std::move(*reserved);
  for (const auto& [name, digest] : recipe.files) {
    const std::string blob = to_hex(digest);
    auto bytes = read_whole_file(blob_file(blob), total);
    const bool whole = bytes && sha256_of(*bytes) == digest;
    note(blob, whole);
    if (!whole) {
      return Error{ErrorCode::failed_precondition,
                   fmt::format("'{}' of the scene's upload is damaged: it {}", name,
                               bytes ? "has another SHA-256" : bytes.error().message),
                   blob_file(blob)};
    }
    bundle.files.push_back({name, std::move(*bytes)});
  }
  return bundle;
}

Result<SceneStore::Recipe> SceneStore::recipe(const std::string& scene_id, MemoryAccount& memory) const {
  const Error none{ErrorCode::not_found, "no recipe of scene '" + scene_id + "' is kept", "scene_id"};
  if (!is_digest(scene_id)) return none;
  auto stored = read_recipe_file(recipe_file(scene_id));
  if (!stored) return stored.error().code == ErrorCode::not_found ? none : stored.error();
  if (stored->scene_id != scene_id || edited_scene_id(stored->loaded_id, stored->changes) != scene_id) {
    return Error{ErrorCode::internal, "the recipe is one of scene '" + stored->scene_id + "'", recipe_file(scene_id)};
  }
  Recipe recipe;
  recipe.loaded_id = stored->loaded_id;
  recipe.changes = stored->changes;
  recipe.request.time_s = stored->time_s;
  recipe.request.animation = stored->animation;
  recipe.request.environment = stored->environment;
  if (stored->upload) {
    auto bundle = read_upload(*stored, memory);
    if (!bundle) return bundle.error();
    recipe.request.files = std::move(*bundle);
  } else {
    if (const Status unchanged = check_disk_files(*stored); !unchanged.ok()) return unchanged.error();
    recipe.request.files = stored->main_file;
  }
  return recipe;
}

std::uint64_t SceneStore::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace helio
