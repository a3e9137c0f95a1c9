#include "tests/support/tev_packet_reader.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>

namespace helio::test {

namespace {

constexpr int kLargestSide = 1 << 20;
constexpr int kMostChannels = 256, kMostCommands = 1 << 20;

// How many floats follow each command of vector graphics. 21: also a string. 23, a font, has only that.
const std::map<int, int> kNumbersOf = {{0, 0},  {1, 0},  {2, 4},  {3, 0},  {4, 4},  {5, 0},  {6, 0},  {7, 0},  {8, 1},
                                       {9, 0},  {10, 2}, {11, 2}, {12, 5}, {13, 6}, {14, 6}, {15, 3}, {16, 4}, {17, 4},
                                       {18, 4}, {19, 5}, {20, 8}, {21, 2}, {22, 1}, {23, 0}, {24, 2}, {25, 2}};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T number(const char* what) {
    T value{};
    if (!enough(sizeof value, what)) return value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  bool flag(const char* what) {
    const auto value = number<std::int8_t>(what);
    if (value != 0 && value != 1) fail(std::string(what) + " is " + std::to_string(value) + ", no bool");
    return value == 1;
  }
  std::string text(const char* what) {
    if (error_) return {};
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos) {
      fail(std::string(what) + " does not end");
      return {};
    }
    std::string value(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return value;
  }
  int integer(const char* what, int low, int high) {
    const auto value = number<std::int32_t>(what);
    if (!error_ && (value < low || value > high)) {
      fail(std::string(what) + " is " + std::to_string(value) + ", not in [" + std::to_string(low) + ", " +
           std::to_string(high) + "]");
    }
    return error_ ? low : value;
  }
  bool enough(std::uint64_t count, const char* what) {
    if (!error_ && bytes_.size() - at_ < count) fail(std::string(what).append(" is cut short"));
    return !error_;
  }
  void fail(const std::string& message) {
    if (!error_) error_ = Error{ErrorCode::invalid_argument, message, "byte " + std::to_string(at_)};
  }
  const std::optional<Error>& error() const { return error_; }
  std::size_t left() const { return bytes_.size() - at_; }
  std::string_view rest() const { return bytes_.substr(at_); }
  void skip(std::size_t count) { at_ += count; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  std::optional<Error> error_;
};

void read_channels(Reader& reader, int count, TevPacket& packet) {
  for (int i = 0; i < count && !reader.error(); ++i) {
    packet.channels.push_back(reader.text("a channel's name"));
    const std::string& name = packet.channels.back();
    if (name.empty() || (name[0] >= '0' && name[0] <= '9')) reader.fail("'" + name + "' is no channel's name");
  }
}

void read_create(Reader& reader, TevPacket& packet) {
  packet.grab_focus = reader.flag("grab");
  packet.name = reader.text("the name");
  packet.width = reader.integer("the width", 1, kLargestSide);
  packet.height = reader.integer("the height", 1, kLargestSide);
  read_channels(reader, reader.integer("the number of channels", 1, kMostChannels), packet);
}

void read_update(Reader& reader, TevPacket& packet) {
  packet.grab_focus = reader.flag("grab");
  packet.name = reader.text("the name");
  const int count = reader.integer("the number of channels", 1, kMostChannels);
  read_channels(reader, count, packet);
  packet.x = reader.integer("x", 0, kLargestSide - 1);
  packet.y = reader.integer("y", 0, kLargestSide - 1);
  packet.width = reader.integer("the width", 1, kLargestSide);
  packet.height = reader.integer("the height", 1, kLargestSide);
  std::vector<std::int64_t> offsets, strides;
  for (int i = 0; i < count && !reader.error(); ++i) offsets.push_back(reader.number<std::int64_t>("an offset"));
  for (int i = 0; i < count && !reader.error(); ++i) strides.push_back(reader.number<std::int64_t>("a stride"));
  if (reader.error()) return;
  const std::int64_t pixels = std::int64_t(packet.width) * packet.height;
  const std::int64_t here = std::int64_t(reader.left() / sizeof(float));
  std::int64_t floats = 0;
  for (int i = 0; i < count; ++i) {
    if (offsets[i] < 0 || strides[i] < 0 || offsets[i] > here || (strides[i] > 0 && pixels - 1 > here / strides[i]))
      return reader.fail("pixels are cut short");
    floats = std::max(floats, offsets[i] + (pixels - 1) * strides[i] + 1);
  }
  if (std::uint64_t(floats) * sizeof(float) != reader.left()) {
    return reader.fail(std::to_string(reader.left()) + " bytes of pixels, expected " +
                       std::to_string(std::uint64_t(floats) * sizeof(float)));
  }
  const char* const from = reader.rest().data();
  for (int i = 0; i < count; ++i) {
    std::vector<float>& plane = packet.planes.emplace_back(std::size_t(pixels));
    for (std::int64_t p = 0; p < pixels; ++p)
      std::memcpy(&plane[std::size_t(p)], from + sizeof(float) * std::size_t(offsets[i] + p * strides[i]),
                  sizeof(float));
  }
  reader.skip(reader.left());
}

void read_graphics(Reader& reader, TevPacket& packet) {
  packet.grab_focus = reader.flag("grab");
  packet.name = reader.text("the name");
  packet.append = reader.flag("append");
  const int count = reader.integer("the number of commands", 0, kMostCommands);
  for (int i = 0; i < count && !reader.error(); ++i) {
    TevPacket::Command& command = packet.commands.emplace_back();
    command.type = reader.number<std::int8_t>("a command");
    const auto numbers = kNumbersOf.find(command.type);
    if (numbers == kNumbersOf.end()) return reader.fail("command " + std::to_string(command.type) + " is unknown");
    for (int n = 0; n < numbers->second; ++n) command.numbers.push_back(reader.number<float>("a number"));
    if (command.type == 21 || command.type == 23) command.text = reader.text("a command's text");
  }
}

}  // namespace

Result<TevPacket> read_tev_packet(std::string_view bytes) {
  Reader reader(bytes);
  const auto length = reader.number<std::uint32_t>("the length");
  if (!reader.error() && length != bytes.size()) {
    reader.fail("the length says " + std::to_string(length) + " of " + std::to_string(bytes.size()) + " bytes");
  }
  TevPacket packet;
  packet.type = static_cast<TevPacket::Type>(reader.number<std::int8_t>("the type"));
  switch (packet.type) {
    case TevPacket::Type::open:
    case TevPacket::Type::open_v2:
      packet.grab_focus = reader.flag("grab");
      packet.name = reader.text("the path");
      if (packet.type == TevPacket::Type::open_v2) packet.selector = reader.text("the selector");
      break;
    case TevPacket::Type::reload:
      packet.grab_focus = reader.flag("grab");
      packet.name = reader.text("the name");
      break;
    case TevPacket::Type::close:
      packet.name = reader.text("the name");
      break;
    case TevPacket::Type::create:
      read_create(reader, packet);
      break;
    case TevPacket::Type::update:
      read_update(reader, packet);
      break;
    case TevPacket::Type::vector_graphics:
      read_graphics(reader, packet);
      break;
    default:
      reader.fail("type " + std::to_string(int(packet.type)) + " is unknown");
  }
  if (!reader.error() && packet.name.empty()) reader.fail("the name is empty");
  if (!reader.error() && reader.left() > 0) reader.fail(std::to_string(reader.left()) + " bytes too many");
  if (reader.error()) return *reader.error();
  return packet;
}

}  // namespace helio::test
