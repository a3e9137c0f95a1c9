#include "client/tev/tev_packets.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <type_traits>

#include "renderer/base/check.h"

namespace helio {

static_assert(std::endian::native == std::endian::little, "pixels are sent as they lie in memory");

namespace {

constexpr int kLargestSide = 1 << 20;
constexpr std::size_t kMostChannels = 64;

enum class PacketType : std::int8_t { close_image = 2, create_image = 4, update_image = 6, vector_graphics = 8 };
enum class Drawing : std::int8_t { stroke_color = 4, stroke = 5, begin_path = 6, rectangle = 18 };

constexpr float kBorderColor[] = {1, 0.6f, 0, 0.8f};  // red, green, blue, alpha

class PacketWriter {
 public:
  explicit PacketWriter(PacketType type) {
    number<std::uint32_t>(0);  // the length, in the end
    number(static_cast<std::int8_t>(type));
  }

  template <class T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void flag(bool value) { number<std::int8_t>(value ? 1 : 0); }
  void text(const std::string& value) { bytes_.append(value.c_str(), value.size() + 1); }
  void drawing(Drawing command) { number(static_cast<std::int8_t>(command)); }

  std::size_t size() const { return bytes_.size(); }
  // `following`: bytes that the caller sends after these.
  std::string finish(std::uint64_t following = 0) && {
    const std::uint64_t length = bytes_.size() + following;
    HELIO_CHECK(length <= std::numeric_limits<std::uint32_t>::max());
    const auto length32 = static_cast<std::uint32_t>(length);
    std::memcpy(bytes_.data(), &length32, sizeof length32);
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

Error refuse(std::string where, std::string message) {
  return {ErrorCode::invalid_argument, std::move(message), std::move(where)};
}

bool has_nul(const std::string& text) {
  return text.find('\0') != std::string::npos;
}

}  // namespace

Status check_tev_image(const TevImage& image) {
  if (image.name.empty() || has_nul(image.name)) return refuse("name", "must not be empty and hold no NUL");
  for (const auto& [where, side] : {std::pair("width", image.width), std::pair("height", image.height)}) {
    if (side < 1 || side > kLargestSide) {
      return refuse(where, std::to_string(side) + " is not in [1, " + std::to_string(kLargestSide) + "]");
    }
  }
  if (image.channels.empty() || image.channels.size() > kMostChannels) {
    return refuse("channels", std::to_string(image.channels.size()) + " of them, allowed are 1 to " +
                                  std::to_string(kMostChannels));
  }
  std::set<std::string> names;
  for (const std::string& channel : image.channels) {
    if (channel.empty() || has_nul(channel)) return refuse("channels", "a name is empty or holds a NUL");
    if (channel[0] >= '0' && channel[0] <= '9') return refuse("channels", "'" + channel + "' begins with a digit");
    if (!names.insert(channel).second) return refuse("channels", "'" + channel + "' is there twice");
  }
  return ok_status();
}

std::string tev_create_image(const TevImage& image, bool grab_focus) {
  PacketWriter packet(PacketType::create_image);
  packet.flag(grab_focus);
  packet.text(image.name);
  packet.number<std::int32_t>(image.width);
  packet.number<std::int32_t>(image.height);
  packet.number(static_cast<std::int32_t>(image.channels.size()));
  for (const std::string& channel : image.channels) packet.text(channel);
  return std::move(packet).finish();
}

Result<std::string> tev_update_image_head(const TevImage& image, const PixelRect& window) {
  HELIO_CHECK(!window.empty() && intersect(window, {0, 0, image.width, image.height}) == window);
  PacketWriter packet(PacketType::update_image);
  packet.flag(false);
  packet.text(image.name);
  packet.number(static_cast<std::int32_t>(image.channels.size()));
  for (const std::string& channel : image.channels) packet.text(channel);
  packet.number<std::int32_t>(window.x0);
  packet.number<std::int32_t>(window.y0);
  packet.number<std::int32_t>(window.width());
  packet.number<std::int32_t>(window.height());
  // In floats: where a channel begins, and from a pixel to the next.
  for (std::size_t c = 0; c < image.channels.size(); ++c) packet.number(std::int64_t(c) * window.area());
  for (std::size_t c = 0; c < image.channels.size(); ++c) packet.number<std::int64_t>(1);
  const std::uint64_t pixel_bytes = std::uint64_t(window.area()) * image.channels.size() * sizeof(float);
  if (packet.size() + pixel_bytes > std::numeric_limits<std::uint32_t>::max()) {
    return refuse("window", std::to_string(window.area()) + " pixels of " + std::to_string(image.channels.size()) +
                                " channels are more than a packet of 4 GiB holds");
  }
  return std::move(packet).finish(pixel_bytes);
}

std::string tev_draw_borders(const TevImage& image, std::span<const PixelRect> windows) {
  PacketWriter packet(PacketType::vector_graphics);
  packet.flag(false);
  packet.text(image.name);
  packet.flag(false);  // instead of what is there
  packet.number(static_cast<std::int32_t>(windows.empty() ? 0 : windows.size() + 3));
  if (windows.empty()) return std::move(packet).finish();
  packet.drawing(Drawing::begin_path);
  for (const PixelRect& window : windows) {
    packet.drawing(Drawing::rectangle);
    for (const int value : {window.x0, window.y0, window.width(), window.height()}) packet.number(float(value));
  }
  packet.drawing(Drawing::stroke_color);
  for (const float value : kBorderColor) packet.number(value);
  packet.drawing(Drawing::stroke);
  return std::move(packet).finish();
}

std::string tev_close_image(const TevImage& image) {
  PacketWriter packet(PacketType::close_image);
  packet.text(image.name);
  return std::move(packet).finish();
}

}  // namespace helio
