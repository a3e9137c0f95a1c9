// What a client may send: the first byte chooses the message, the others are its protobuf bytes.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "server/base/parse_message.h"
#include "server/rpc/scene_edit_messages.h"
#include "server/stream/convert.h"

namespace {

using namespace helio;

// What validation lets through lies in the ranges that the rest of the daemon counts on.
void demand(bool condition) {
  if (!condition) std::abort();
}

void read(const pb::View& message) {
  static const std::vector<CameraDescription> kCameras(2);
  Problems problems;
  const View view = read_view(message, {&kCameras, 0, 5}, "view", problems);
  if (!problems.empty()) return;
  Problems again;
  validate(view, "view", again);
  demand(again.empty() && view.id > 5);
}

void read(const pb::RenderSettings& message) {
  const RenderLimits limits;
  Problems problems;
  const RenderSettings settings = read_settings(message, limits, "settings", problems);
  if (!problems.empty()) return;
  (void)check_film_size(settings, limits, "settings");
  demand(settings.width >= 1 && settings.width <= limits.max_film_side && settings.height >= 1 &&
         settings.max_segments >= 1 && settings.roulette_from >= 1);
  const auto& modes = kEveryRenderMode;
  demand(std::find(std::begin(modes), std::end(modes), settings.mode) != std::end(modes));
  demand(to_message(settings).mode() == message.mode() || message.mode() == pb::MODE_UNSPECIFIED);
  demand(settings.filter.scale > 0 && settings.filter.scale <= kMaxPixelFilterScale);
}

void read(const pb::Budget& message) {
  Problems problems;
  const Budget budget = read_budget(message, "budget", problems);
  if (!problems.empty()) return;
  Problems again;
  validate(budget, "budget", again);
  demand(again.empty());
}

void read(const pb::TileFormat& message) {
  Problems problems;
  const TileFormat format = read_tile_format(message, "format", problems);
  demand((format.channels & ~unsigned(kResolveAll | kDisplayByOidn)) == 0);
  // Without the library nobody gets that far.
  demand(!problems.empty() || !(format.channels & kDisplayByOidn));
}

// A scene with one of each thing that can be edited.
const SceneDescription& small_scene() {
  static const SceneDescription kScene = [] {
    SceneDescription scene;
    scene.materials.emplace_back().name = "m";
    scene.objects.resize(1);
    scene.instances.emplace_back().name = "o";
    scene.lights.emplace_back().name = "l";
    scene.environment = Environment{};
    return scene;
  }();
  return kScene;
}

void read(const pb::EditSceneRequest& message) {
  Problems problems;
  const std::vector<SceneEdit> edits = read_scene_edits(message, problems);
  if (!problems.empty()) return;
  const auto changes = resolve_edits(small_scene(), edits);
  if (!changes) return demand(!changes.error().message.empty());
  for (const auto& [index, change] : changes->materials) {
    const MaterialValues& to = change.to;
    demand(index == 0 && to.roughness >= 0 && to.roughness <= 1);
    for (int c = 0; c < 3; ++c) demand(to.base_color[c] >= 0 && to.base_color[c] <= 1 && to.emission[c] >= 0);
    demand(is_finite(to.emission));
  }
  for (const auto& [index, change] : changes->lights) demand(index == 0 && is_finite(change.to));
  if (changes->environment) demand(is_finite(changes->environment->to));
  (void)edited_scene_id("scene", *changes);
}

void read(const pb::StreamRequest&) {}
void read(const pb::RunJobRequest&) {}

template <class Message>
void parse_and_read(grpc::ByteBuffer bytes) {
  Message message;
  const Status parsed = parse_message(bytes, message);
  if (parsed) {
    demand(unknown_fields(message).size() <= kMaxUnknownFields);
    read(message);
  } else {
    demand(!parsed.error().message.empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const grpc::Slice slice(data + 1, size - 1);
  const grpc::ByteBuffer bytes(&slice, 1);
  switch (data[0] % 7) {
    case 0: parse_and_read<pb::View>(bytes); break;
    case 1: parse_and_read<pb::RenderSettings>(bytes); break;
    case 2: parse_and_read<pb::Budget>(bytes); break;
    case 3: parse_and_read<pb::TileFormat>(bytes); break;
    case 4: parse_and_read<pb::StreamRequest>(bytes); break;
    case 5: parse_and_read<pb::RunJobRequest>(bytes); break;
    case 6:
      parse_and_read<pb::EditSceneRequest>(bytes);
      break;
  }
  return 0;
}
