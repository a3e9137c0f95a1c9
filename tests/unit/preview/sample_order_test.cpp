// Which pixels of a preview get paths, and when.
#include "renderer/preview/sample_order.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>
#include <vector>

namespace helio {
namespace {

constexpr int kWidth = 256, kHeight = 128;

std::vector<PixelPosition> order(const GazeDensity* density, std::size_t most = ~std::size_t(0)) {
  PreviewHistory history(kWidth, kHeight);
  return SampleOrder::merge({SampleOrder::find({0, 0, kWidth, kHeight}, history, density)}, most);
}

std::size_t within(const std::vector<PixelPosition>& pixels, const PixelRect& window) {
  std::size_t count = 0;
  for (const PixelPosition& p : pixels) count += window.contains(p.x, p.y);
  return count;
}

TEST(SampleOrder, TheFirstAreSpreadEvenly) {
  const auto first = order(nullptr, kWidth * kHeight / 64);
  ASSERT_EQ(first.size(), std::size_t(kWidth * kHeight / 64));
  for (int y = 0; y < kHeight; y += 32) {
    for (int x = 0; x < kWidth; x += 32) EXPECT_EQ(within(first, {x, y, x + 32, y + 32}), 16u);
  }
}

TEST(SampleOrder, NoPixelComesTwice) {
  const GazeDensity density({40, 40}, kHeight, 1);
  for (const GazeDensity* gaze : {static_cast<const GazeDensity*>(nullptr), &density}) {
    std::set<std::pair<int, int>> seen;
    for (const PixelPosition& p : order(gaze)) EXPECT_TRUE(seen.insert({p.x, p.y}).second);
  }
}

// Of any number of paths, a pixel at the gaze gets as many times more as the density says.
TEST(SampleOrder, FollowsTheGaze) {
  const GazeDensity density({16, 64}, kHeight, 0.5);
  const PixelRect near{0, 48, 32, 80}, far{224, 0, 256, 128};
  const double share =
      density.mean_over(far) * double(far.area()) / (density.mean_over(near) * double(near.area()));
  for (const std::size_t most : {300u, 600u}) {
    const auto first = order(&density, most);
    EXPECT_NEAR(double(within(first, far)) / double(within(first, near)), share, 0.4 * share) << most;
  }
  // And however much time there is, no more than that share.
  EXPECT_LT(double(within(order(&density), far)), 1.5 * double(density.at(224, 64)) * double(far.area()));
}

}  // namespace
}  // namespace helio
