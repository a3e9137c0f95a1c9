#include "server/state/scene_recipe.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/state/scene_recipe.pb.h"
#include "server/state/sealed_message.h"

namespace helio {
namespace {

namespace kept = heliograph::kept;
using Message = kept::SceneRecipe;

constexpr std::uint32_t kVersion = 2;
constexpr int kNumbers = 16;  // of a matrix

void write(const Rgb& from, Message::Rgb& to) {
  to.set_r(from.x);
  to.set_g(from.y);
  to.set_b(from.z);
}
void write(const MaterialValues& from, Message::MaterialValues& to) {
  write(from.base_color, *to.mutable_base_color());
  write(from.emission, *to.mutable_emission());
  to.set_roughness(from.roughness);
}
void write(const M44d& from, google::protobuf::RepeatedField<double>& to) {
  to.Reserve(kNumbers);
  for (int i = 0; i < kNumbers; ++i) to.Add(from[i / 4][i % 4]);
}

void read(const Message::Rgb& from, Rgb& to) {
  to = {from.r(), from.g(), from.b()};
}
void read(const Message::MaterialValues& from, MaterialValues& to) {
  read(from.base_color(), to.base_color);
  read(from.emission(), to.emission);
  to.roughness = from.roughness();
}
void read(const google::protobuf::RepeatedField<double>& from, M44d& to) {
  for (int i = 0; i < kNumbers; ++i) to[i / 4][i % 4] = from[i];
}

template <class T, class Change>
void write_change(const Changed<T>& from, Change& to) {
  write(from.from, *to.mutable_from());
  write(from.to, *to.mutable_to());
}
template <class Change, class T>
void read_change(const Change& from, Changed<T>& to) {
  read(from.from(), to.from);
  read(from.to(), to.to);
}

Error damaged(const std::string& why) {
  return {ErrorCode::internal, "is damaged: " + why, {}};
}

}  // namespace

std::vector<std::string> SceneRecipe::blobs() const {
  std::vector<std::string> names;
  if (!upload) return names;
  for (const auto& [name, digest] : files) names.push_back(to_hex(digest));
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

SceneRecipe make_recipe(const LoadedScene& scene) {
  SceneRecipe recipe;
  recipe.scene_id = scene.id;
  recipe.loaded_id = scene.edited_from.empty() ? scene.id : scene.edited_from;
  recipe.time_s = scene.manifest.time_s;
  recipe.animation = scene.manifest.animation;
  recipe.environment = scene.manifest.environment;
  recipe.upload = scene.disk_files.empty();
  recipe.main_file = recipe.upload ? scene.manifest.main_file : scene.disk_main_file;
  recipe.files = recipe.upload ? scene.manifest.files : scene.disk_files;
  recipe.changes = scene.changes;
  return recipe;
}

std::vector<std::uint8_t> encode_recipe(const SceneRecipe& recipe) {
  Message message;
  message.set_scene_id(recipe.scene_id);
  message.set_loaded_id(recipe.loaded_id);
  message.set_time_s(recipe.time_s);
  message.set_animation(recipe.animation);
  message.set_environment(recipe.environment);
  message.set_main_file(recipe.main_file);
  message.set_upload(recipe.upload);
  for (const auto& [name, digest] : recipe.files) {
    Message::File& file = *message.add_files();
    file.set_name(name);
    file.set_sha256(digest.data(), digest.size());
  }
  for (const auto& [object, change] : recipe.changes.transforms) {
    Message::TransformChange& row = *message.add_transforms();
    row.set_object(object);
    write_change(change, row);
  }
  for (const auto& [material, change] : recipe.changes.materials) {
    Message::MaterialChange& row = *message.add_materials();
    row.set_material(material);
    write_change(change, row);
  }
  for (const auto& [light, change] : recipe.changes.lights) {
    Message::LightChange& row = *message.add_lights();
    row.set_light(light);
    write_change(change, row);
  }
  if (const auto& change = recipe.changes.environment) write_change(*change, *message.mutable_environment_radiance());
  return seal(message, kVersion);
}

Result<SceneRecipe> decode_recipe(std::span<const std::uint8_t> bytes) {
  Message message;
  if (const Status read = unseal(bytes, kVersion, message); !read.ok()) return read.error();
  SceneRecipe recipe;
  recipe.scene_id = message.scene_id();
  recipe.loaded_id = message.loaded_id();
  recipe.time_s = message.time_s();
  recipe.animation = message.animation();
  recipe.environment = message.environment();
  recipe.main_file = message.main_file();
  recipe.upload = message.upload();
  for (const Message::File& file : message.files()) {
    Sha256Digest& digest = recipe.files[file.name()];
    if (file.sha256().size() != digest.size()) {
      return damaged(fmt::format("a SHA-256 has {} bytes; allowed: {}", file.sha256().size(), digest.size()));
    }
    std::copy(file.sha256().begin(), file.sha256().end(), digest.begin());
  }
  for (const Message::TransformChange& row : message.transforms()) {
    if (row.from_size() != kNumbers || row.to_size() != kNumbers) {
      return damaged(fmt::format("matrices of object {} have {} and {} numbers; allowed: {}", row.object(),
                                 row.from_size(), row.to_size(), kNumbers));
    }
    read_change(row, recipe.changes.transforms[row.object()]);
  }
  for (const auto& row : message.materials()) read_change(row, recipe.changes.materials[row.material()]);
  for (const auto& row : message.lights()) read_change(row, recipe.changes.lights[row.light()]);
  if (message.has_environment_radiance())
    read_change(message.environment_radiance(), recipe.changes.environment.emplace());
  return recipe;
}

}  // namespace helio
