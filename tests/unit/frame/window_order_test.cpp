#include "renderer/frame/window_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "renderer/frame/tile_grid.h"

namespace helio {
namespace {

std::vector<PixelRect> tiles_of(const PixelRect& region, int tile_size) {
  std::vector<PixelRect> tiles;
  const TileGrid grid(region, tile_size);
  for (const Tile& tile : grid.tiles()) tiles.push_back(tile.window);
  return tiles;
}

// What a part may have read: its pixels and those around them, as far as it may look.
PixelRect grown(const PixelRect& window) {
  constexpr int kBy = WindowOrder::kReach;
  return {window.x0 - kBy, window.y0 - kBy, window.x1 + kBy, window.y1 + kBy};
}

struct Cut {
  PixelRect region;
  int tile_size;
};

const Cut kCuts[] = {{{0, 0, 300, 170}, 128},
                     {{0, 0, 300, 170}, 48},
                     {{37, 21, 201, 140}, 64},
                     {{5, 5, 6, 6}, 128},
                     {{0, 0, 16, 700}, 16}};

// By however many workers, in whatever order they come back.
TEST(WindowOrder, NoPartBeginsBeforeWhatItMayReadIsDone) {
  for (const Cut& cut : kCuts) {
    for (const int workers : {1, 2, 7, 1000}) {
      const std::vector<PixelRect> tiles = tiles_of(cut.region, cut.tile_size);
      WindowOrder order(tiles);
      std::mt19937 random(1);
      std::vector<std::size_t> in_hand;
      std::set<std::size_t> begun;
      std::int64_t done[WindowOrder::kSweeps] = {};
      std::map<std::tuple<int, int, int>, bool> pixel_done;  // by sweep, x / 8, y / 8
      std::set<std::uint32_t> finished_tiles;
      for (;;) {
        while (int(in_hand.size()) < workers) {
          const auto part = order.next();
          if (!part) break;
          ASSERT_TRUE(begun.insert(*part).second) << "handed out twice";
          in_hand.push_back(*part);
          const auto [sweep, window] = order.part(*part);
          if (sweep == 0) continue;
          const PixelRect reads = intersect(grown(window), cut.region);
          for (int y = reads.y0; y < reads.y1; y = y / 8 * 8 + 8) {
            for (int x = reads.x0; x < reads.x1; x = x / 8 * 8 + 8)
              ASSERT_TRUE((pixel_done[{sweep - 1, x / 8, y / 8}])) << sweep << ": " << x << ", " << y;
          }
        }
        if (in_hand.empty()) break;
        std::swap(in_hand[random() % in_hand.size()], in_hand.back());
        const auto [sweep, window] = order.part(in_hand.back());
        for (int y = window.y0; y < window.y1; y = y / 8 * 8 + 8) {
          for (int x = window.x0; x < window.x1; x = x / 8 * 8 + 8) pixel_done[{sweep, x / 8, y / 8}] = true;
        }
        done[sweep] += window.area();
        order.finish(in_hand.back());
        in_hand.pop_back();
        while (const auto tile = order.next_finished_tile()) {
          ASSERT_TRUE(finished_tiles.insert(*tile).second);
          const PixelRect& pixels = tiles[*tile];
          for (int y = pixels.y0; y < pixels.y1; y = y / 8 * 8 + 8) {
            for (int x = pixels.x0; x < pixels.x1; x = x / 8 * 8 + 8)
              ASSERT_TRUE((pixel_done[{WindowOrder::kSweeps - 1, x / 8, y / 8}]));
          }
        }
      }
      EXPECT_EQ(begun.size(), order.parts());
      EXPECT_EQ(finished_tiles.size(), tiles.size());
      for (const std::int64_t area : done) EXPECT_EQ(area, cut.region.area());
    }
  }
}

// What the first tile waits for is its own work and that of the rings around it.
TEST(WindowOrder, TilesAreReadyOneAfterTheOther) {
  const std::vector<PixelRect> tiles = tiles_of({0, 0, 1280, 720}, 128);
  WindowOrder order(tiles);
  std::int64_t pixels[WindowOrder::kSweeps] = {};
  std::vector<std::uint32_t> finished;
  while (const auto part = order.next()) {
    const auto [sweep, window] = order.part(*part);
    if (finished.empty()) pixels[sweep] += window.area();
    order.finish(*part);
    while (const auto tile = order.next_finished_tile()) finished.push_back(*tile);
  }
  constexpr int kOne = WindowOrder::kWindow;
  EXPECT_EQ(pixels[0], (128 + 4 * kOne) * (128 + 4 * kOne));
  EXPECT_EQ(pixels[1], (128 + 2 * kOne) * (128 + 2 * kOne));
  EXPECT_EQ(pixels[2], 128 * 128);
  ASSERT_EQ(finished.size(), tiles.size());
  EXPECT_TRUE(std::is_sorted(finished.begin(), finished.end()));
}

TEST(WindowOrder, OfNothingIsDone) {
  WindowOrder order({});
  EXPECT_FALSE(order.next());
  EXPECT_EQ(order.parts(), 0u);
  EXPECT_FALSE(order.next_finished_tile());
}

}  // namespace
}  // namespace helio
