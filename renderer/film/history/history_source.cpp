#include "renderer/film/history/history_source.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "renderer/film/core/lanes.h"
#include "renderer/film/core/packed_values.h"
#include "renderer/film/core/pixel_hash.h"
#include "renderer/film/history/splat_row.h"
#include "renderer/film/splats/splat_buffer.h"

namespace helio {
namespace {

constexpr float kLargest = 1e8f;  // of a mean over the albedo: squares of products of differences stay floats

// A half's means, times `factor`, in [-largest, largest]; the last lane means nothing. Precondition: count > 0.
Float4 means_of(const HalfPixel& half, const SplatRow& splats, int x, const Double4& factor, double largest) {
  Double4 sums, splat = {};
  load(half.sum, sums);  // and what comes after them
  if (splats.any()) load(splats.means(x), splat);
  const Double4 means = (sums * (1.0 / half.count) + splat) * factor;
  const Double4 most = {largest, largest, largest, largest};
  return __builtin_convertvector(means > most ? most : (means < -most ? -most : means), Float4);
}

// The halves' means over the albedo, of a window and two pixels around it.
struct Means {
  struct Halves {
    Float4 a, b;  // of zero in the last lane
  };
  int x0 = 0, y0 = 0, width = 0;
  std::vector<Halves> values;
  std::vector<std::uint8_t> inside;  // both halves are known, and the pixel shows one surface

  std::size_t at(int x, int y) const { return std::size_t(y - y0) * std::size_t(width) + std::size_t(x - x0); }
};

void read_means(const Film& film, const PixelRect& border, const PixelRect& region, Means& out) {
  out.x0 = border.x0;
  out.y0 = border.y0;
  out.width = border.width();
  out.values.resize(std::size_t(border.area()));
  out.inside.assign(std::size_t(border.area()), 0);
  const PixelRect known = intersect(border, region);
  std::uint32_t packed_albedo = ~0u;
  Double4 factor = {1, 1, 1, 0};
  thread_local SplatRow splats[kHalves];
  for (int y = known.y0; y < known.y1; ++y) {
    for (int h = 0; h < kHalves; ++h) splats[h].look(film, h, y, known.x0, known.x1, false);
    std::size_t i = out.at(known.x0, y);
    for (int x = known.x0; x < known.x1; ++x, ++i) {
      const CentreHit& centre = film.history()->centre(x, y);
      const HalfPixel &a = film.half(0, x, y), &b = film.half(1, x, y);
      if (a.count == 0 || b.count == 0 || centre.border || film.history()->carried(x, y).mixed()) continue;
      out.inside[i] = 1;
      if (centre.albedo != packed_albedo) {
        packed_albedo = centre.albedo;
        const Rgb divisor = demodulation(unpack_reflectance(packed_albedo));
        for (int c = 0; c < 3; ++c) factor[c] = double(1 / divisor[c]);
      }
      constexpr Float4 kChannels = {1, 1, 1, 0};
      out.values[i] = {means_of(a, splats[0], x, factor, kLargest) * kChannels,
                       means_of(b, splats[1], x, factor, kLargest) * kChannels};
    }
  }
}

// Products of the halves' differences around a pixel, mean over the channels, their squared standard errors, and how
// many there are.
// Lanes: slope along x and y, bend along x and y.
struct Products {
  Float4 sum = {}, errors2 = {}, count = {};

  void add(const Products& other) {
    sum += other.sum;
    errors2 += other.errors2;
    count += other.count;
  }
};

// Between pixels inside a surface. Precondition: the pixel and its neighbours are in `means`.
Products products_at(const Means& means, int x, int y) {
  Products out;
  const std::size_t here = means.at(x, y);
  if (!means.inside[here]) return out;
  const Means::Halves& middle = means.values[here];
  Float4 terms[4] = {}, noise[4] = {};
  const auto note = [&](int lane, const Float4& a, const Float4& b) {
    terms[lane] = a * b;
    noise[lane] = (a - b) * (a - b);
    out.count[lane] = 1;
  };
  for (int axis = 0; axis < 2; ++axis) {
    const std::size_t step = axis == 0 ? 1 : std::size_t(means.width);
    if (!means.inside[here + step]) continue;
    const Means::Halves& after = means.values[here + step];
    note(axis, after.a - middle.a, after.b - middle.b);
    if (!means.inside[here - step]) continue;
    const Means::Halves& before = means.values[here - step];
    note(2 + axis, before.a - 2 * middle.a + after.a, before.b - 2 * middle.b + after.b);
  }
  out.sum = lane_sums(terms) * (1.0f / 3);
  // Of x y, whose deviations' squares add up to q: (x^2 + y^2) q / 2 and, of small ones, q^2 / 4.
  const Float4 q = lane_sums(noise) * (1.0f / 3), product = out.sum < 0 ? -out.sum : out.sum;
  out.errors2 = q * (product + 0.25f * q);
  return out;
}

// Sums over 3x3 pixels, of a window; row-major.
void sum_products(const Means& means, const PixelRect& window, std::vector<Products>& out) {
  thread_local std::vector<Products> row;
  const int width = window.width();
  row.resize(std::size_t(width) + 2);
  out.assign(std::size_t(window.area()), Products{});
  for (int y = window.y0 - 1; y <= window.y1; ++y) {
    for (int i = 0; i < width + 2; ++i) row[std::size_t(i)] = products_at(means, window.x0 - 1 + i, y);
    for (int i = 0; i < width; ++i) {
      Products three = row[std::size_t(i)];
      three.add(row[std::size_t(i) + 1]);
      three.add(row[std::size_t(i) + 2]);
      for (int to = std::max(y - 1, window.y0); to <= std::min(y + 1, window.y1 - 1); ++to)
        out[std::size_t(to - window.y0) * std::size_t(width) + std::size_t(i)].add(three);
    }
  }
}

// Mean of some products, less the standard error that it has: what fireflies make of them is mostly noise of either
// sign, and weights must not follow it. Where the halves agree even one in nine, a spot of light, is structure.
float mean_product(float sum, float errors2, float count) {
  return count > 0 ? std::max(sum - std::sqrt(errors2), 0.0f) / count : 0.0f;
}

// Of one sample, its share of the splats' included.
Rgb sample_variance(const HalfPixel& half, const SplatRow& splats, int x) {
  if (splats.any()) {
    return Rgb(float(splats.sample_variance(half, x, 0)), float(splats.sample_variance(half, x, 1)),
               float(splats.sample_variance(half, x, 2)));
  }
  const float divisor = half.count > 1 ? 1 / (float(half.count) - 1) : 0.0f;
  return Rgb(half.deviations[0], half.deviations[1], half.deviations[2]) * divisor;
}

// Splats leave directions of their own (SplatBuffer::told): for as many of the half's places as they have a share in
// what counts of its mean, by chance.
void mix_directions(const Film& film, const SplatRow& splats, const Rgb& mean, int h, int x, int y,
                    DirectionReservoir& directions) {
  const double whole = double(luminance(mean));
  if (!splats.any() || !(whole > 0)) return;
  const double* splat = splats.means(x);
  const double brought = std::clamp(double(luminance(Rgb(V3d(splat[0], splat[1], splat[2])))), 0.0, whole);
  const ToldLight told = film.splats()->told(h, x, y);
  const float camera_share = directions.share(h);
  const double splatted = brought * double(DirectionReservoir::counting(told.share));
  const double counts = splatted + (whole - brought) * double(DirectionReservoir::counting(camera_share));
  for (int k = 0; k < DirectionReservoir::kPlaces; ++k) {
    const auto place = std::uint64_t(h * DirectionReservoir::kPlaces + k + 1);
    // What chance: that of this picture, and of no other.
    const float u = dither(x, y, hash64(place ^ hash64(film.splats()->light_paths(h))));
    if (double(u) * counts < splatted) directions.set_direction(h, k, told.direction);
  }
  directions.set_share(h, float((brought * double(told.share) + (whole - brought) * double(camera_share)) / whole));
}

}  // namespace

void HistorySource::gather(const Film& film, const PixelRect& window, const PixelRect& region) {
  thread_local Means means;
  thread_local std::vector<Products> sums;
  const PixelRect border = {window.x0 - 2, window.y0 - 2, window.x1 + 2, window.y1 + 2};
  read_means(film, border, region, means);
  sum_products(means, window, sums);
  auto products = sums.begin();
  thread_local SplatRow splats[kHalves];
  const FilmHistory& history = *film.history();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int h = 0; h < kHalves; ++h) splats[h].look(film, h, y, window.x0, window.x1, true);
    for (int x = window.x0; x < window.x1; ++x, ++products) {
      pixels_[index(x, y)] = {{}, history.centre(x, y), history.directions(x, y)};
      SourcePixel& to = pixel(x, y);
      const HalfPixel& a = film.half(0, x, y);
      const HalfPixel& b = film.half(1, x, y);
      if (a.count == 0 && b.count == 0) continue;
      const CarriedPixel& carried = history.carried(x, y);
      if (carried.mixed() && !history.centre(x, y).border) to.note_mixed();
      if (carried.looked_up() && carried.count[0] + carried.count[1] > 0) to.note_looked_up();
      to.set_bias2(float(std::min(history.bias2(x, y, a.count, b.count), double(FLT_MAX))));
      float inverse[kHalves] = {0, 0};
      Rgb means_here[kHalves];
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& half = h == 0 ? a : b;
        if (half.count == 0) continue;
        inverse[h] = float(1.0 / half.count);
        const Float4 mean = means_of(half, splats[h], x, Double4{1, 1, 1, 0}, FLT_MAX);
        means_here[h] = Rgb(mean[0], mean[1], mean[2]);
        to.set_spread(h, sample_variance(half, splats[h], x));
        mix_directions(film, splats[h], means_here[h], h, x, y, pixels_[index(x, y)].directions);
      }
      if (a.count == 0) means_here[0] = means_here[1];
      if (b.count == 0) means_here[1] = means_here[0];
      to.means = PackedMeans(means_here[0], means_here[1]);
      const Products& p = *products;
      to.set_structure(mean_product(p.sum[2], p.errors2[2], p.count[2]),
                       mean_product(p.sum[3], p.errors2[3], p.count[3]),
                       mean_product(p.sum[0] + p.sum[1], p.errors2[0] + p.errors2[1], p.count[0] + p.count[1]));
      to.set_counts(inverse, float(history.weight(x, y, a.count, b.count)) * carried.age);
    }
  }
}

}  // namespace helio
