#include "server/rpc/scene_edit_messages.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <limits>
#include <string>

#include "server/rpc/scene_messages.h"

namespace helio {
namespace {

namespace pb = heliograph::v1;

constexpr int kTransformNumbers = 12;
constexpr std::size_t kMaxName = 4096;

// The nearest float; what is negative stays so.
float to_float(double value) {
  const float nearest = float(value);
  return value < 0 && nearest == 0 ? -std::numeric_limits<float>::denorm_min() : nearest;
}

std::optional<Rgb> colour(bool given, const pb::Vec3& message) {
  if (!given) return std::nullopt;
  return Rgb(to_float(message.x()), to_float(message.y()), to_float(message.z()));
}

template <class Message>
EditTarget target(const Message& message, const std::string& where, Problems& problems) {
  switch (message.target_case()) {
    case Message::kName:
      if (message.name().size() <= kMaxName) return message.name();
      problems.add(where + ".name", fmt::format("{} bytes; allowed: at most {}", message.name().size(), kMaxName));
      return std::string();
    case Message::kIndex:
      return message.index();
    default:
      problems.add(where, "has no target; allowed: one of name, index");
      return std::string();
  }
}

SceneEdit read(const pb::ObjectEdit& message, const std::string& where, Problems& problems) {
  ObjectEdit edit;
  edit.target = target(message, where, problems);
  edit.relative = message.relative();
  if (message.transform_size() != kTransformNumbers) {
    problems.add(where + ".transform",
                 fmt::format("{} numbers; allowed: {}, row by row", message.transform_size(), kTransformNumbers));
    return edit;
  }
  // Rows of the message are columns of a matrix that row vectors are multiplied with.
  for (int i = 0; i < kTransformNumbers; ++i) edit.transform[i % 4][i / 4] = message.transform(i);
  return edit;
}

SceneEdit read(const pb::MaterialEdit& message, const std::string& where, Problems& problems) {
  MaterialEdit edit;
  edit.target = target(message, where, problems);
  edit.base_color = colour(message.has_base_color(), message.base_color());
  edit.emission = colour(message.has_emission(), message.emission());
  if (message.has_roughness()) edit.roughness = to_float(message.roughness());
  return edit;
}

SceneEdit read(const pb::LightEdit& message, const std::string& where, Problems& problems) {
  LightEdit edit;
  edit.target = target(message, where, problems);
  edit.intensity = colour(message.has_intensity(), message.intensity());
  if (message.has_scale()) edit.scale = message.scale();
  return edit;
}

SceneEdit read(const pb::EnvironmentEdit& message, const std::string&, Problems&) {
  EnvironmentEdit edit;
  edit.radiance = colour(message.has_radiance(), message.radiance());
  if (message.has_scale()) edit.scale = message.scale();
  return edit;
}

}  // namespace

std::vector<SceneEdit> read_scene_edits(const pb::EditSceneRequest& message, Problems& problems) {
  std::vector<SceneEdit> edits;
  if (message.edits_size() < 1 || message.edits_size() > int(kMaxSceneEdits)) {
    problems.add("edits", fmt::format("{} edits; allowed: [1, {}]", message.edits_size(), kMaxSceneEdits));
    return edits;
  }
  for (int i = 0; i < message.edits_size(); ++i) {
    const pb::SceneEdit& edit = message.edits(i);
    const std::string where = fmt::format("edits[{}]", i);
    switch (edit.edit_case()) {
      case pb::SceneEdit::kObject:
        edits.push_back(read(edit.object(), where + ".object", problems));
        break;
      case pb::SceneEdit::kMaterial:
        edits.push_back(read(edit.material(), where + ".material", problems));
        break;
      case pb::SceneEdit::kLight:
        edits.push_back(read(edit.light(), where + ".light", problems));
        break;
      case pb::SceneEdit::kEnvironment:
        edits.push_back(read(edit.environment(), where + ".environment", problems));
        break;
      case pb::SceneEdit::EDIT_NOT_SET:
        problems.add(where, "is empty; allowed: one of object, material, light, environment");
        break;
    }
  }
  return edits;
}

pb::EditSceneResponse to_edit_response(const LoadedScene& scene, bool already_there) {
  pb::LoadSceneResponse loaded = to_load_response(scene, already_there);
  pb::EditSceneResponse response;
  *response.mutable_scene() = std::move(*loaded.mutable_scene());
  *response.mutable_notices() = std::move(*loaded.mutable_notices());
  response.set_already_there(already_there);
  const EditSummary* edit = scene.snapshot->edit();
  response.set_shares_bvh(!edit || edit->shares_bvh);
  return response;
}

}  // namespace helio
