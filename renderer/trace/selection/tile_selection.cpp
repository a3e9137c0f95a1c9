#include "renderer/trace/selection/tile_selection.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace helio {

namespace {

// Share of the light paths' error that is the splats'.
constexpr double kSplatShare = 0.5;
// What a choice between tiles must gain over doing the same everywhere, for it is made from few samples a tile.
constexpr double kLeastGain = 0.3;
// And light paths for all tiles: they cost memory, and hold back the tiles until the picture is whole.
constexpr double kLeastGainOfAll = 0.1;
// By what factor one way for all tiles must beat the other for the choice to be clear.
constexpr double kClearly = 2;

}  // namespace

double error_of_fewer_light_paths(double share) {
  return 1 + kSplatShare * (1 / share - 1);
}

TileSelection choose_tiles(const std::vector<TileEstimate>& tiles) {
  const std::size_t count = tiles.size();
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t(0));
  const auto gain = [&](std::size_t t) {
    const auto& [path, bdpt] = tiles[t];
    return (path.error - bdpt.error) / std::max(bdpt.cost - path.cost, 1e-9 * path.cost);
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return gain(a) > gain(b); });
  double rest = 0, cost = 0;
  for (const TileEstimate& tile : tiles) {
    rest += tile.path.error;
    cost += tile.path.cost;
  }
  std::vector<double> product{rest * cost};
  double with = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto& [path, bdpt] = tiles[order[k]];
    rest -= path.error;
    with += bdpt.error;
    cost += bdpt.cost - path.cost;
    const double fewer = error_of_fewer_light_paths(double(k + 1) / double(count));
    product.push_back((std::max(rest, 0.0) + with * fewer) * cost);
  }
  std::size_t best = std::size_t(std::min_element(product.begin(), product.end()) - product.begin());
  const std::size_t alike = product.back() < (1 - kLeastGainOfAll) * product.front() ? count : 0;
  if (product[best] > (1 - kLeastGain) * product[alike]) best = alike;
  TileSelection choice{std::vector<bool>(count, false), false};
  for (std::size_t k = 0; k < best; ++k) choice.on[order[k]] = true;
  const auto [less, more] = std::minmax(product.front(), product.back());
  choice.clear = best == alike && more >= kClearly * less && more > 0;
  return choice;
}

}  // namespace helio
