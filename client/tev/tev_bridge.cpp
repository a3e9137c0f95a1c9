#include "client/tev/tev_bridge.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "client/tev/tev_tile.h"

namespace helio {

namespace pb = heliograph::v1;

TevBridge::TevBridge(TevAddress address, const pb::TileFormat& format, std::function<void(const std::string&)> warn,
                     const TevTiming& timing)
    : channels_(tev_channels(format)), name_("heliograph"), sender_(std::move(address), std::move(warn), timing) {}

void TevBridge::set_name(const std::string& scene, const std::string& session_id) {
  std::string name = scene + " " + session_id;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  const std::lock_guard lock(mutex_);
  name_ = std::move(name);
}

std::string TevBridge::image_name() const {
  const std::lock_guard lock(mutex_);
  return name_;
}

Status TevBridge::begin(const pb::RenderSettings& settings) {
  return sender_.begin({image_name(), settings.width(), settings.height(), channels_});
}

void TevBridge::add(pb::Tile tile) {
  if (tile.preview() || tile.exr().empty()) return;
  const pb::Rect& rect = tile.window();
  const PixelRect window{rect.x0(), rect.y0(), rect.x1(), rect.y1()};
  const auto exr = std::make_shared<const std::string>(std::move(*tile.mutable_exr()));
  // Refused where the window lies outside of the image: whoever puts the picture together tells of that.
  static_cast<void>(sender_.update(window, [exr, window, this](std::vector<float>& planes) {
    return read_tev_tile(*exr, window, channels_, planes);
  }));
}

}  // namespace helio
