// What a client may send: the first byte chooses the message, the others are its protobuf bytes.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "server/convert.h"
#include "server/message_check.h"

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
  demand((format.channels & ~unsigned(kResolveAll)) == 0);
}

void read(const pb::StreamRequest&) {}
void read(const pb::RunJobRequest&) {}

template <class Message>
void parse_and_read(grpc::ByteBuffer bytes) {
  Message message;
  const Status parsed = parse_message(bytes, message);
  if (parsed) {
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
  switch (data[0] % 6) {
    case 0: parse_and_read<pb::View>(bytes); break;
    case 1: parse_and_read<pb::RenderSettings>(bytes); break;
    case 2: parse_and_read<pb::Budget>(bytes); break;
    case 3: parse_and_read<pb::TileFormat>(bytes); break;
    case 4: parse_and_read<pb::StreamRequest>(bytes); break;
    case 5: parse_and_read<pb::RunJobRequest>(bytes); break;
  }
  return 0;
}
