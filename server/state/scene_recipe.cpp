#include "server/state/scene_recipe.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "renderer/codec/checksum.h"

namespace helio {
namespace {

using nlohmann::json;

constexpr int kVersion = 1;

json to_json(const Rgb& c) {
  return {c.x, c.y, c.z};
}
json to_json(const M44d& m) {
  json numbers = json::array();
  for (int i = 0; i < 16; ++i) numbers.push_back(m[i / 4][i % 4]);
  return numbers;
}
json to_json(const MaterialValues& values) {
  return {to_json(values.base_color), to_json(values.emission), values.roughness};
}

void read(const json& from, Rgb& to) {
  for (int i = 0; i < 3; ++i) to[i] = from.at(std::size_t(i)).get<float>();
}
void read(const json& from, M44d& to) {
  for (int i = 0; i < 16; ++i) to[i / 4][i % 4] = from.at(std::size_t(i)).get<double>();
}
void read(const json& from, MaterialValues& to) {
  read(from.at(0), to.base_color);
  read(from.at(1), to.emission);
  to.roughness = from.at(2).get<float>();
}

template <class T>
json to_json(const std::map<std::uint32_t, Changed<T>>& changes) {
  json rows = json::array();
  for (const auto& [index, change] : changes) rows.push_back({index, to_json(change.from), to_json(change.to)});
  return rows;
}

template <class T>
void read(const json& from, std::map<std::uint32_t, Changed<T>>& to) {
  for (const json& row : from) {
    Changed<T>& change = to[row.at(0).get<std::uint32_t>()];
    read(row.at(1), change.from);
    read(row.at(2), change.to);
  }
}

Sha256Digest digest_of(const json& bytes) {
  const json::binary_t& binary = bytes.get_binary();
  Sha256Digest digest{};
  if (binary.size() != digest.size()) throw json::other_error::create(501, "a digest has not 32 bytes", &bytes);
  std::copy(binary.begin(), binary.end(), digest.begin());
  return digest;
}

SceneRecipe read_recipe(const json& from) {
  SceneRecipe recipe;
  from.at("scene").get_to(recipe.scene_id);
  from.at("loaded").get_to(recipe.loaded_id);
  from.at("time_s").get_to(recipe.time_s);
  from.at("animation").get_to(recipe.animation);
  from.at("environment").get_to(recipe.environment);
  from.at("main_file").get_to(recipe.main_file);
  from.at("upload").get_to(recipe.upload);
  for (const json& file : from.at("files")) recipe.files[file.at(0).get<std::string>()] = digest_of(file.at(1));
  read(from.at("transforms"), recipe.changes.transforms);
  read(from.at("materials"), recipe.changes.materials);
  read(from.at("lights"), recipe.changes.lights);
  if (const json& environment = from.at("radiance"); !environment.empty()) {
    Changed<Rgb>& change = recipe.changes.environment.emplace();
    read(environment.at(0), change.from);
    read(environment.at(1), change.to);
  }
  return recipe;
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
  json files = json::array();
  for (const auto& [name, digest] : recipe.files) {
    files.push_back({name, json::binary(std::vector<std::uint8_t>(digest.begin(), digest.end()))});
  }
  json radiance = json::array();
  if (const auto& change = recipe.changes.environment) radiance = {to_json(change->from), to_json(change->to)};
  const json all = {{"version", kVersion},
                    {"scene", recipe.scene_id},
                    {"loaded", recipe.loaded_id},
                    {"time_s", recipe.time_s},
                    {"animation", recipe.animation},
                    {"environment", recipe.environment},
                    {"main_file", recipe.main_file},
                    {"upload", recipe.upload},
                    {"files", std::move(files)},
                    {"transforms", to_json(recipe.changes.transforms)},
                    {"materials", to_json(recipe.changes.materials)},
                    {"lights", to_json(recipe.changes.lights)},
                    {"radiance", std::move(radiance)}};
  std::vector<std::uint8_t> bytes = json::to_cbor(all);
  const std::uint32_t sum = crc32_of(bytes.data(), bytes.size());
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(std::uint8_t(sum >> shift));
  return bytes;
}

Result<SceneRecipe> decode_recipe(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 4) return damaged(fmt::format("it has {} bytes", bytes.size()));
  const auto content = bytes.first(bytes.size() - 4);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum |= std::uint32_t(bytes[content.size() + i]) << (8 * i);
  if (sum != crc32_of(content.data(), content.size())) return damaged("its checksum is another");
  try {
    const json from = json::from_cbor(content.begin(), content.end());
    if (const int version = from.at("version").get<int>(); version != kVersion) {
      return Error{ErrorCode::internal,
                   fmt::format("has version {}; this program reads version {}", version, kVersion), {}};
    }
    return read_recipe(from);
  } catch (const json::exception& exception) {
    return damaged(exception.what());
  }
}

}  // namespace helio
