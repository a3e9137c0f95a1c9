#include <algorithm>
#include <cmath>

#include "renderer/scene/images/environment.h"

namespace helio {
namespace {

// What the counts of a cumulative table add up to.
constexpr double kTotalCount = 4294967295.0;

// Integral of the unit tent max(0, 1 - |x|) from -infinity to x.
double tent_integral(double x) {
  x = std::clamp(x, -1.0, 1.0);
  return x < 0 ? 0.5 * (1 + x) * (1 + x) : 1 - 0.5 * (1 - x) * (1 - x);
}

// The mean of a linear interpolation between texel centres over an interval, as weights of consecutive texels.
struct Footprint {
  int first = 0;  // may lie outside of the image by one texel
  std::vector<double> weights;
};

// Footprint of cell i of `cells` over `texels` texels.
Footprint cell_footprint(int i, int cells, int texels) {
  const double begin = double(i) * texels / cells, end = double(i + 1) * texels / cells;
  Footprint footprint;
  footprint.first = int(std::floor(begin - 0.5));
  const int last = int(std::ceil(end - 0.5));
  for (int k = footprint.first; k <= last; ++k) {
    footprint.weights.push_back((tent_integral(end - k - 0.5) - tent_integral(begin - k - 0.5)) / (end - begin));
  }
  return footprint;
}

std::vector<Footprint> cell_footprints(int cells, int texels) {
  std::vector<Footprint> footprints;
  footprints.reserve(std::size_t(cells));
  for (int i = 0; i < cells; ++i) footprints.push_back(cell_footprint(i, cells, texels));
  return footprints;
}

// Cells along both axes: two a texel while they fit, then one for every `k` texels.
int cells_along(int texels, std::int64_t all_texels) {
  if (4 * all_texels <= std::int64_t(EnvironmentDistribution::kMaxCells)) return 2 * texels;
  std::int64_t k = 1;
  while (all_texels / (k * k) > std::int64_t(EnvironmentDistribution::kMaxCells)) ++k;
  return int(std::max<std::int64_t>(1, texels / k));
}

// Writes cumulative counts out of kTotalCount: proportional to the weights, but at least one where the weight is not 0.
// All zero when the weights are.
void make_cumulative(const std::vector<double>& weights, std::uint32_t* cdf) {
  double total = 0;
  std::size_t positive = 0;
  for (const double weight : weights) {
    total += weight;
    positive += weight > 0;
  }
  const double shared = kTotalCount - double(positive);
  double sum = 0;
  std::size_t passed = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    passed += weights[i] > 0;
    const double part = total > 0 ? std::min(1.0, sum / total) : 0.0;
    cdf[i] = passed == positive && positive > 0 ? std::uint32_t(kTotalCount)
                                                : std::uint32_t(std::floor(shared * part)) + std::uint32_t(passed);
  }
}

// Index of the cell that holds count x, and how far into it x lies, [0, 1).
struct Pick {
  int index;
  double within;
};

Pick pick(const std::uint32_t* cdf, int size, float u) {
  const double x = double(u) * kTotalCount;
  const auto count = std::uint32_t(std::min(x, kTotalCount - 1));
  const int index = int(std::upper_bound(cdf, cdf + size, count) - cdf);
  const double low = index > 0 ? cdf[index - 1] : 0;
  return {index, std::clamp((x - low) / (cdf[index] - low), 0.0, 1.0)};
}

}  // namespace

EnvironmentDistribution::EnvironmentDistribution(const EnvironmentMap& map) : map_(map) {
  const TextureTable* textures = map.textures();
  const int image = map.slot().image;
  const int width = textures ? textures->width(image) : 1, height = textures ? textures->height(image) : 1;
  columns_ = cells_along(width, std::int64_t(width) * height);
  rows_ = cells_along(height, std::int64_t(width) * height);

  row_cos_.resize(std::size_t(rows_) + 1);
  for (int row = 0; row <= rows_; ++row) row_cos_[std::size_t(row)] = std::cos(M_PI * row / rows_);
  row_cos_.back() = -1;

  // Maps come prepared (prepare_environment_image); a negative weight would still unsort the tables.
  const auto texel_luminance = [&](int x, int y) {
    if (!textures) return double(luminance(map.scale()));
    const V4f texel = textures->texel(image, map.slot().encoding, x, y);
    return std::max(0.0, double(luminance(Rgb(texel.x, texel.y, texel.z) * map.scale())));
  };
  const std::vector<Footprint> across = cell_footprints(columns_, width);
  column_cdf_.resize(std::size_t(columns_) * std::size_t(rows_));
  row_cdf_.resize(std::size_t(rows_));
  std::vector<double> row_weights(row_cdf_.size(), 0.0);
  std::vector<double> weights(std::size_t(columns_), 0.0), line(std::size_t(width), 0.0);

  const auto fill = [&](auto&& cell_weights) {
    for (int row = 0; row < rows_; ++row) {
      cell_weights(row);
      double sum = 0;
      for (const double weight : weights) sum += weight;
      const double solid_angle = 2 * M_PI / columns_ * (row_cos_[std::size_t(row)] - row_cos_[std::size_t(row) + 1]);
      row_weights[std::size_t(row)] = sum * solid_angle;
      make_cumulative(weights, column_cdf_.data() + std::size_t(row) * std::size_t(columns_));
    }
  };
  fill([&](int row) {
    const Footprint down = cell_footprint(row, rows_, height);
    std::fill(line.begin(), line.end(), 0.0);
    for (std::size_t k = 0; k < down.weights.size(); ++k) {
      if (down.weights[k] <= 0) continue;
      const int y = std::clamp(down.first + int(k), 0, height - 1);
      for (int x = 0; x < width; ++x) line[std::size_t(x)] += down.weights[k] * texel_luminance(x, y);
    }
    for (int column = 0; column < columns_; ++column) {
      const Footprint& footprint = across[std::size_t(column)];
      double sum = 0;
      for (std::size_t k = 0; k < footprint.weights.size(); ++k) {
        const int x = (footprint.first + int(k) + width) % width;
        sum += footprint.weights[k] * line[std::size_t(x)];
      }
      weights[std::size_t(column)] = sum;
    }
  });
  for (const double weight : row_weights) total_luminance_ += weight;
  if (total_luminance_ <= 0) {
    fill([&](int) { std::fill(weights.begin(), weights.end(), 1.0); });
    total_luminance_ = 0;
  }
  make_cumulative(row_weights, row_cdf_.data());

  density_.resize(std::size_t(rows_));
  for (int row = 0; row < rows_; ++row) {
    const double solid_angle = 2 * M_PI / columns_ * (row_cos_[std::size_t(row)] - row_cos_[std::size_t(row) + 1]);
    density_[std::size_t(row)] = float(1 / (solid_angle * kTotalCount * kTotalCount));
  }
}

EnvironmentSample EnvironmentDistribution::sample(const V2f& u) const {
  const Pick row = pick(row_cdf_.data(), rows_, u.y);
  const Pick column = pick(column_cdf_.data() + std::size_t(row.index) * std::size_t(columns_), columns_, u.x);
  const double top = row_cos_[std::size_t(row.index)], bottom = row_cos_[std::size_t(row.index) + 1];
  const double cos_theta = top + (bottom - top) * row.within;
  const auto sin_theta = float(std::sqrt(std::max(0.0, (1 - cos_theta) * (1 + cos_theta))));
  const auto phi = float(2 * M_PI * (column.index + column.within) / columns_);
  EnvironmentSample sample;
  sample.direction = map_.to_world({std::sin(phi) * sin_theta, float(cos_theta), -std::cos(phi) * sin_theta});
  sample.pdf_w = pdf_w(sample.direction);
  return sample;
}

float EnvironmentDistribution::pdf_w(const V3f& direction) const {
  const V2f uv = environment_uv(map_.to_map(direction));
  const int column = std::min(int(uv.x * float(columns_)), columns_ - 1);
  const int row = std::min(int(uv.y * float(rows_)), rows_ - 1);
  const std::uint32_t* cdf = column_cdf_.data() + std::size_t(row) * std::size_t(columns_);
  const std::uint32_t in_row = cdf[column] - (column > 0 ? cdf[column - 1] : 0);
  const std::uint32_t of_row = row_cdf_[std::size_t(row)] - (row > 0 ? row_cdf_[std::size_t(row) - 1] : 0);
  return float(in_row) * float(of_row) * density_[std::size_t(row)];
}

std::size_t EnvironmentDistribution::memory_bytes() const {
  return sizeof(*this) + (column_cdf_.capacity() + row_cdf_.capacity()) * sizeof(std::uint32_t) +
         row_cos_.capacity() * sizeof(double) + density_.capacity() * sizeof(float);
}

}  // namespace helio
