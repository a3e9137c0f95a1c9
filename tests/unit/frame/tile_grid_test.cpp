#include "renderer/frame/tile_grid.h"

#include <gtest/gtest.h>

#include <vector>

namespace helio {
namespace {

// How often each pixel of the film lies in a cell.
std::vector<int> coverage(const TileGrid& grid, int width, int height) {
  std::vector<int> count(std::size_t(width) * std::size_t(height), 0);
  for (const Tile& tile : grid.tiles()) {
    for (int row = 0; row < tile.rows; ++row) {
      for (int column = 0; column < tile.columns; ++column) {
        const PixelRect w = grid.window(tile, column, row, 1);
        EXPECT_FALSE(w.empty());
        EXPECT_EQ(w, intersect(w, tile.window));
        for (int y = w.y0; y < w.y1; ++y)
          for (int x = w.x0; x < w.x1; ++x) ++count[std::size_t(y) * std::size_t(width) + std::size_t(x)];
      }
    }
  }
  return count;
}

TEST(TileGrid, CellsCoverTheRegionOnceAndNothingElse) {
  const int width = 203, height = 151;
  for (const PixelRect region : {PixelRect{0, 0, width, height}, PixelRect{13, 27, 190, 131}, PixelRect{7, 7, 8, 8},
                                 PixelRect{127, 0, 129, height}, PixelRect{202, 150, 203, 151}}) {
    for (const int tile_size : {1, 8, 20, 64, 128, 1000}) {
      const std::vector<int> count = coverage(TileGrid(region, tile_size), width, height);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          ASSERT_EQ(count[std::size_t(y) * width + std::size_t(x)], int(region.contains(x, y))) << x << " " << y;
    }
  }
}

TEST(TileGrid, CutsAreAlignedToTheFilm) {
  const TileGrid grid(PixelRect{30, 30, 300, 300}, 128);
  for (const Tile& tile : grid.tiles()) {
    for (const int edge : {tile.window.x0, tile.window.y0}) EXPECT_TRUE(edge == 30 || edge % 128 == 0) << edge;
    for (const int edge : {tile.window.x1, tile.window.y1}) EXPECT_TRUE(edge == 300 || edge % 128 == 0) << edge;
    EXPECT_EQ(grid.window(tile, 1, 1, 1).x0 % kCellSize, 0);
  }
}

TEST(TileGrid, TheMiddleComesFirst) {
  const TileGrid grid(PixelRect{0, 0, 640, 640}, 128);
  ASSERT_EQ(grid.tiles().size(), 25u);
  EXPECT_EQ(grid.tiles()[0].window, (PixelRect{256, 256, 384, 384}));
}

TEST(TileGrid, ProgressIsThatOfTheLastPixel) {
  TileGrid grid(PixelRect{0, 0, 64, 32}, 32);
  ASSERT_EQ(grid.tiles().size(), 2u);
  std::uint32_t done[kHalves];
  for (const Tile& tile : grid.tiles())
    for (int row = 0; row < tile.rows; ++row)
      for (int column = 0; column < tile.columns; ++column) grid.cell(tile, column, row).done[0] = 4;
  grid.cell(grid.tiles()[1], 1, 1).done[0] = 3;
  grid.done_everywhere(done);
  EXPECT_EQ(done[0], 3u);
  EXPECT_EQ(done[1], 0u);
  EXPECT_EQ(grid.samples_in(grid.tiles()[0]), 4u);
  EXPECT_EQ(grid.samples_in(grid.tiles()[1]), 3u);
  grid.clear();
  grid.done_everywhere(done);
  EXPECT_EQ(done[0], 0u);
}

}  // namespace
}  // namespace helio
