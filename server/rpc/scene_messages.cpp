#include "server/rpc/scene_messages.h"

#include <algorithm>

#include "server/stream/convert.h"

namespace helio {
namespace {

// Keeps the answer below the message limit whatever a file contains.
constexpr int kMaxCameras = 256;
constexpr int kMaxAnimations = 256;
constexpr int kMaxLines = 256;
constexpr std::size_t kMaxLine = 1000;

// Returns how many lines there are, `more` counting those that the report itself leaves out.
std::uint32_t add_lines(const std::vector<std::string>& lines, std::size_t more,
                        google::protobuf::RepeatedPtrField<std::string>& out) {
  const std::size_t total = lines.size() + more;
  for (const std::string& line : lines) {
    if (out.size() == kMaxLines) break;
    *out.Add() = printable(line, kMaxLine);
  }
  if (const std::size_t told = std::size_t(out.size()); told < total)
    *out.Add() = "and " + std::to_string(total - told) + " more like these";
  return std::uint32_t(total);
}

}  // namespace

std::string printable(const std::string& text, std::size_t size) {
  std::string out;
  for (std::size_t i = 0; i < text.size() && out.size() < size;) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead >> 5 == 6 ? 2 : lead >> 4 == 14 ? 3 : lead >> 3 == 30 ? 4 : 0;
    const bool whole = length > 0 && i + length <= text.size() &&
                       std::all_of(text.begin() + i + 1, text.begin() + i + length,
                                   [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; });
    out += whole ? text.substr(i, length) : "?";
    i += whole ? length : 1;
  }
  return out;
}

pb::SceneInfo to_scene_info(const LoadedScene& scene, std::size_t first_camera) {
  const SceneDescription& description = scene.snapshot->description();
  const RenderSceneStats& stats = scene.snapshot->stats();
  pb::SceneInfo info;
  info.set_scene_id(scene.id);
  info.set_name(printable(description.name, kMaxName));
  info.set_triangles(stats.triangles);
  info.set_instanced_triangles(stats.instanced_triangles);
  info.set_meshes(std::uint32_t(stats.meshes));
  info.set_instances(std::uint32_t(description.instances.size()));
  info.set_materials(std::uint32_t(description.materials.size()));
  info.set_textures(std::uint32_t(stats.images));
  info.set_lights(scene.snapshot->features().light_count);
  for (std::size_t i = first_camera; i < description.cameras.size(); ++i) {
    if (info.cameras_size() == kMaxCameras) break;
    const CameraDescription& camera = description.cameras[i];
    pb::SceneCamera& entry = *info.add_cameras();
    entry.set_name(printable(camera.name, kMaxName));
    *entry.mutable_view() = to_message(camera_pose(camera));
    entry.set_aspect(camera.aspect);
    entry.set_width(camera.width);
    entry.set_height(camera.height);
    if (!camera.crop.empty()) write_rect(camera.crop, *entry.mutable_crop());
    if (camera.filter) {
      entry.set_filter(to_message(camera.filter->kind));
      if (camera.filter->kind != PixelFilterKind::box) entry.set_filter_scale(camera.filter->scale);
    }
  }
  info.set_camera_total(std::uint32_t(description.cameras.size()));
  for (const std::string& name : description.animations) {
    if (info.animations_size() == kMaxAnimations) break;
    info.add_animations(printable(name, kMaxName));
  }
  info.set_animation_total(std::uint32_t(description.animations.size()));
  info.set_animation(printable(description.animation, kMaxName));
  info.set_max_segments(description.hints.max_segments);
  info.set_roulette_from(description.hints.roulette_from);
  for (const std::string& name : scene.snapshot->features().names()) info.add_features(name);
  info.set_memory_bytes(stats.memory_bytes);
  info.set_own_bytes(stats.own_bytes);
  info.set_edited_from(scene.edited_from);
  if (const Box3d bounds = scene.snapshot->world_bounds(); !bounds.isEmpty()) {
    write_vector(bounds.min, *info.mutable_bounds_min());
    write_vector(bounds.max, *info.mutable_bounds_max());
  }
  info.set_references(std::uint32_t(std::max(0, scene.references.load())));
  info.set_load_seconds(scene.load_seconds);
  info.set_build_seconds(stats.build_seconds);
  return info;
}

pb::LoadSceneResponse to_load_response(const LoadedScene& scene, bool already_loaded) {
  pb::LoadSceneResponse response;
  *response.mutable_scene() = to_scene_info(scene);
  const LoadReport& report = scene.report;
  response.set_warnings_total(add_lines(report.warnings, report.more_warnings, *response.mutable_warnings()));
  response.set_notices_total(add_lines(report.notices, report.more_notices, *response.mutable_notices()));
  response.set_unread_total(add_lines(report.unread, report.more_unread, *response.mutable_unread()));
  response.set_already_loaded(already_loaded);
  return response;
}

}  // namespace helio
