#include "renderer/film/display/blend_errors.h"

#include <algorithm>
#include <cmath>

namespace helio {
namespace {

// Sums of so much from a neighbourhood are floats still.
constexpr float kMost = 1e35f;
// Brightness, of the picture's mean, below which differences count as if they were as bright.
constexpr float kDarkest = 1e-3f;

// The squared bias that is told by the mean of products of residuals, given the mean of their squares. A mean below
// half of its own standard error hardly counts: its noise above zero would add up to an error that is not there.
float bias(float residuals, float squares, float pixels) {
  if (!(residuals > 0)) return 0;
  const float uncertain = std::sqrt(squares / (4 * pixels)) / residuals;
  return residuals / (1 + sqr(uncertain));
}

}  // namespace

float BlendErrors::of_share(float share) const {
  const float rest = 1 - share;
  return std::max(rest * film + share * filtered - share * rest * apart, 0.0f);
}

void BlendEvidence::begin(const PixelRect& window) {
  window_ = window;
  const auto size = std::size_t(window.width() + 2 * kRadius) * std::size_t(window.height() + 2 * kRadius);
  for (auto& of_class : terms_) {
    for (std::vector<float>& term : of_class) term.assign(size, 0.0f);
  }
}

void BlendEvidence::add(int x, int y, bool border, const Pixel& p) {
  const float scale = 1 / (sqr(p.brightness) + sqr(kDarkest));
  float values[kTerms];
  values[kVariance] = p.variance;
  values[kNoise] = p.noise;
  values[kResiduals] = p.residuals;
  values[kSquares] = sqr(p.residuals);
  values[kApart] = p.apart;
  values[kRelGain] = (p.variance - p.noise + p.apart) * scale;
  values[kRelResiduals] = p.residuals * scale;
  values[kRelSquares] = sqr(p.residuals * scale);
  values[kRelApart] = p.apart * scale;
  values[kCount] = 1;
  const std::size_t i = wide_at(x, y);
  for (int k = 0; k < kTerms; ++k) terms_[border][k][i] = std::clamp(values[k], -kMost, kMost);
}

void BlendEvidence::average() {
  static_assert(2 * kRadius + 1 == 8 + 2 + 1);
  const auto width = std::size_t(window_.width()), wide = width + 2 * kRadius;
  const auto height = std::size_t(window_.height()), high = height + 2 * kRadius;
  for (std::vector<float>& rows : rows_) rows.resize(wide * high);
  float *const two = rows_[0].data(), *const four = rows_[1].data(), *const eight = rows_[2].data();
  // Sums of 2, 4, 8 and then 11 neighbours.
  for (auto& of_class : terms_) {
    for (std::vector<float>& term : of_class) {
      float* const v = term.data();
      for (std::size_t i = 0; i < wide * (high - 1); ++i) two[i] = v[i] + v[i + wide];
      for (std::size_t i = 0; i < wide * (high - 3); ++i) four[i] = two[i] + two[i + 2 * wide];
      for (std::size_t i = 0; i < wide * (high - 7); ++i) eight[i] = four[i] + four[i + 4 * wide];
      for (std::size_t i = 0; i < wide * height; ++i) v[i] += eight[i + wide] + two[i + 9 * wide];
      for (std::size_t y = 0; y < height; ++y) {
        const float* const row = v + y * wide;
        for (std::size_t x = 0; x + 1 < wide; ++x) two[x] = row[x] + row[x + 1];
        for (std::size_t x = 0; x + 3 < wide; ++x) four[x] = two[x] + two[x + 2];
        for (std::size_t x = 0; x + 7 < wide; ++x) eight[x] = four[x] + four[x + 4];
        float* const out = v + y * width;
        for (std::size_t x = 0; x < width; ++x) out[x] = row[x] + eight[x + 1] + two[x + 9];
      }
    }
  }
}

float BlendEvidence::best_share(int x, int y, bool border) const {
  const auto& terms = terms_[border];
  const std::size_t i = at(x, y);
  const float pixels = terms[kCount][i], apart = terms[kRelApart][i];
  if (!(pixels > 0 && apart > 0)) return 0;
  const float b = bias(terms[kRelResiduals][i] / pixels, terms[kRelSquares][i] / pixels, pixels) * pixels;
  return std::clamp((terms[kRelGain][i] - b) / (2 * apart), 0.0f, 1.0f);
}

BlendErrors BlendEvidence::errors(int x, int y, bool border) const {
  const auto& terms = terms_[border];
  const std::size_t i = at(x, y);
  BlendErrors errors;
  const float pixels = terms[kCount][i];
  if (!(pixels > 0)) return errors;
  const float share = 1 / pixels;
  errors.known = true;
  errors.film = terms[kVariance][i] * share;
  errors.filtered = terms[kNoise][i] * share + bias(terms[kResiduals][i] * share, terms[kSquares][i] * share, pixels);
  errors.apart = terms[kApart][i] * share;
  return errors;
}

}  // namespace helio
