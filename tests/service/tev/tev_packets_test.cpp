// The bytes of packets, by hand and by a reader that was written apart from their writer.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

#include "client/tev/tev_address.h"
#include "client/tev/tev_packets.h"
#include "tests/support/tev_packet_reader.h"

namespace helio::test {
namespace {

using Type = TevPacket::Type;

const TevImage kImage{"box s-1", 40, 30, {"R", "samples"}};

// With pixels that count up.
std::string update_packet(const TevImage& image, const PixelRect& window) {
  std::string packet = tev_update_image_head(image, window).value();
  for (std::size_t i = 0; i < std::size_t(window.area()) * image.channels.size(); ++i) {
    const auto value = float(i);
    packet.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return packet;
}

TEST(TevPackets, CreateImageByHand) {
  using namespace std::string_literals;
  // 34 bytes: length, type, grab, name, width, height, number of channels, their names.
  TevImage image = kImage;
  image.channels = {"R", "error"};
  EXPECT_EQ(tev_create_image(image, true), "\x22\0\0\0"s + "\x04" + "\x01" + "box s-1\0"s + "\x28\0\0\0"s +
                                               "\x1e\0\0\0"s + "\x02\0\0\0"s + "R\0"s + "error\0"s);
}

TEST(TevPackets, AreReadBackAsTheyWereMeant) {
  auto packet = read_tev_packet(tev_create_image(kImage, false));
  ASSERT_TRUE(packet) << packet.error().to_string();
  EXPECT_EQ(packet->type, Type::create);
  EXPECT_FALSE(packet->grab_focus);
  EXPECT_EQ(packet->name, kImage.name);
  EXPECT_EQ(packet->width, 40);
  EXPECT_EQ(packet->height, 30);
  EXPECT_EQ(packet->channels, kImage.channels);

  packet = read_tev_packet(update_packet(kImage, {8, 16, 11, 18}));
  ASSERT_TRUE(packet) << packet.error().to_string();
  EXPECT_EQ(packet->type, Type::update);
  EXPECT_EQ(packet->name, kImage.name);
  EXPECT_EQ(packet->channels, kImage.channels);
  EXPECT_EQ(packet->x, 8);
  EXPECT_EQ(packet->y, 16);
  EXPECT_EQ(packet->width, 3);
  EXPECT_EQ(packet->height, 2);
  EXPECT_EQ(packet->planes, (std::vector<std::vector<float>>{{0, 1, 2, 3, 4, 5}, {6, 7, 8, 9, 10, 11}}));

  const PixelRect windows[] = {{0, 0, 16, 16}, {16, 0, 40, 16}};
  packet = read_tev_packet(tev_draw_borders(kImage, windows));
  ASSERT_TRUE(packet) << packet.error().to_string();
  EXPECT_EQ(packet->type, Type::vector_graphics);
  EXPECT_FALSE(packet->append);
  ASSERT_EQ(packet->commands.size(), 5u);
  EXPECT_EQ(packet->commands[0].type, 6);  // begins a path
  EXPECT_EQ(packet->commands[1].type, 18);
  EXPECT_EQ(packet->commands[1].numbers, (std::vector<float>{0, 0, 16, 16}));
  EXPECT_EQ(packet->commands[2].numbers, (std::vector<float>{16, 0, 24, 16}));
  EXPECT_EQ(packet->commands[3].type, 4);  // colour
  EXPECT_EQ(packet->commands[4].type, 5);  // draws it

  packet = read_tev_packet(tev_draw_borders(kImage, {}));
  ASSERT_TRUE(packet) << packet.error().to_string();
  EXPECT_TRUE(packet->commands.empty());

  packet = read_tev_packet(tev_close_image(kImage));
  ASSERT_TRUE(packet) << packet.error().to_string();
  EXPECT_EQ(packet->type, Type::close);
  EXPECT_EQ(packet->name, kImage.name);
}

TEST(TevPackets, TheReaderRefusesWhatIsCutShortOrTooLong) {
  const PixelRect windows[] = {{0, 0, 16, 16}};
  for (const std::string& whole : {tev_create_image(kImage, true), update_packet(kImage, {0, 0, 2, 2}),
                                   tev_draw_borders(kImage, windows), tev_close_image(kImage)}) {
    ASSERT_TRUE(read_tev_packet(whole));
    for (std::size_t size = 0; size < whole.size(); ++size) {
      std::string cut = whole.substr(0, size);
      EXPECT_FALSE(read_tev_packet(cut)) << size;
      if (size < 4) continue;
      const auto length = std::uint32_t(size);
      std::memcpy(cut.data(), &length, sizeof length);  // and says so
      EXPECT_FALSE(read_tev_packet(cut)) << size;
    }
    std::string longer = whole + '\1';
    const auto length = std::uint32_t(longer.size());
    std::memcpy(longer.data(), &length, sizeof length);
    EXPECT_FALSE(read_tev_packet(longer));
  }
}

TEST(TevPackets, ImagesThatNoViewerCouldHoldAreRefused) {
  const auto problem = [](const std::function<void(TevImage&)>& change) {
    TevImage image = kImage;
    change(image);
    const Status status = check_tev_image(image);
    return status ? std::string() : status.error().to_string();
  };
  EXPECT_EQ(problem([](TevImage&) {}), "");
  EXPECT_EQ(problem([](TevImage& i) { i.channels = {"R", "2nd"}; }), "channels: '2nd' begins with a digit");
  EXPECT_EQ(problem([](TevImage& i) { i.channels = {"R", "R"}; }), "channels: 'R' is there twice");
  EXPECT_NE(problem([](TevImage& i) { i.channels = {}; }), "");
  EXPECT_NE(problem([](TevImage& i) { i.channels = {""}; }), "");
  EXPECT_NE(problem([](TevImage& i) { i.name = ""; }), "");
  EXPECT_NE(problem([](TevImage& i) { i.name = std::string("a\0b", 3); }), "");
  EXPECT_EQ(problem([](TevImage& i) { i.width = 0; }), "width: 0 is not in [1, 1048576]");
  EXPECT_NE(problem([](TevImage& i) { i.height = 1 << 21; }), "");
  // 2^15 squared pixels of two floats are 8 GiB.
  EXPECT_FALSE(tev_update_image_head({"a", 1 << 15, 1 << 15, {"R", "G"}}, {0, 0, 1 << 15, 1 << 15}));
}

TEST(TevAddress, TakesItsThreeFormsAndTellsThemToOthers) {
  for (const char* text : {"127.0.0.1:14158", "localhost:1", "[::1]:65535", "unix:/tmp/tev.sock"}) {
    const auto address = resolve_tev_address(text);
    ASSERT_TRUE(address) << address.error().to_string();
    EXPECT_FALSE(address->endpoints.empty()) << text;
  }
  for (const std::string& text :
       {std::string("nowhere"), std::string("127.0.0.1"), std::string("127.0.0.1:0"), std::string("127.0.0.1:65536"),
        std::string("::1:14158"), std::string("unix:"), "unix:/" + std::string(107, 'a')}) {
    const auto address = resolve_tev_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(address.error().message.find("'" + text + "' is not HOST:PORT"), std::string::npos)
        << address.error().message;
  }
  const auto unknown = resolve_tev_address("no-such-host.invalid:14158");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("no-such-host.invalid"), std::string::npos) << unknown.error().message;
}

}  // namespace
}  // namespace helio::test
