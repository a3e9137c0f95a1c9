#include "client/cli/commands/contact_sheet.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

#include "renderer/codec/display_image.h"

namespace helio::cli {

namespace {

constexpr int kMostPixels = 192;  // of a copy, either side
constexpr int kGap = 4;
constexpr float kGround = 0.03f;

// Digits and comma, three columns by five rows, the topmost first: a bit a pixel, the left one highest.
constexpr std::string_view kLetters = "0123456789,";
constexpr std::uint16_t kShapes[] = {0x7b6f, 0x2c97, 0x73e7, 0x72cf, 0x5bc9, 0x79cf,
                                     0x79ef, 0x7252, 0x7bef, 0x7bcf, 0x0014};
constexpr int kLetterWidth = 3, kLetterHeight = 5, kLetterScale = 2;

struct Sheet {
  int width = 0, height = 0;
  std::vector<float> channels[3];

  void fill(int x0, int y0, int x1, int y1, float value) {
    for (int y = std::max(y0, 0); y < std::min(y1, height); ++y) {
      for (int x = std::max(x0, 0); x < std::min(x1, width); ++x) {
        for (auto& channel : channels) channel[std::size_t(y) * std::size_t(width) + std::size_t(x)] = value;
      }
    }
  }
};

void draw_label(Sheet& sheet, int left, int top, const std::string& label) {
  constexpr int kStep = (kLetterWidth + 1) * kLetterScale;
  sheet.fill(left, top, left + kStep * int(label.size()) + kLetterScale, top + (kLetterHeight + 2) * kLetterScale, 0);
  left += kLetterScale;
  top += kLetterScale;
  for (const char letter : label) {
    const std::size_t known = kLetters.find(letter);
    for (int bit = 0; known != std::string_view::npos && bit < kLetterWidth * kLetterHeight; ++bit) {
      if (!(kShapes[known] >> (kLetterWidth * kLetterHeight - 1 - bit) & 1)) continue;
      const int x = left + bit % kLetterWidth * kLetterScale, y = top + bit / kLetterWidth * kLetterScale;
      sheet.fill(x, y, x + kLetterScale, y + kLetterScale, 1);
    }
    left += kStep;
  }
}

int divided_up(int value, int by) {
  return (value + by - 1) / by;
}

}  // namespace

ContactSheet::ContactSheet(int width, int height)
    : factor_(std::max(1, divided_up(std::max(width, height), kMostPixels))),
      width_(divided_up(width, factor_)),
      height_(divided_up(height, factor_)) {}

void ContactSheet::add(int row, std::string label, const PictureView& picture) {
  if (rows_.size() <= std::size_t(row)) rows_.resize(std::size_t(row) + 1);
  Copy copy;
  copy.label = std::move(label);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        double sum = 0;
        int count = 0;
        for (int v = y * factor_; v < std::min((y + 1) * factor_, picture.height); ++v) {
          for (int u = x * factor_; u < std::min((x + 1) * factor_, picture.width); ++u, ++count) {
            sum += picture.channels[c][std::size_t(v) * std::size_t(picture.width) + std::size_t(u)];
          }
        }
        copy.channels[c].push_back(float(sum / count));
      }
    }
  }
  rows_[std::size_t(row)].push_back(std::move(copy));
}

std::vector<double> ContactSheet::exposures() const {
  std::vector<double> exposures;
  for (const std::vector<Copy>& row : rows_) {
    std::vector<float> sums[3];
    for (int c = 0; c < 3; ++c) {
      sums[c].assign(std::size_t(width_) * std::size_t(height_), 0.0f);
      for (const Copy& copy : row) {
        for (std::size_t p = 0; p < sums[c].size(); ++p) sums[c][p] += copy.channels[c][p];
      }
    }
    exposures.push_back(auto_exposure({width_, height_, {sums[0].data(), sums[1].data(), sums[2].data()}}));
  }
  return exposures;
}

Status ContactSheet::write(const std::string& path, const std::vector<double>& exposures) const {
  std::size_t columns = 1;
  for (const std::vector<Copy>& row : rows_) columns = std::max(columns, row.size());
  Sheet sheet;
  sheet.width = int(columns) * (width_ + kGap) + kGap;
  sheet.height = int(rows_.size()) * (height_ + kGap) + kGap;
  for (auto& channel : sheet.channels) channel.assign(std::size_t(sheet.width) * std::size_t(sheet.height), kGround);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    int left = kGap + int(columns - rows_[r].size()) * (width_ + kGap) / 2;
    const int top = kGap + int(r) * (height_ + kGap);
    for (const Copy& copy : rows_[r]) {
      for (int c = 0; c < 3; ++c) {
        for (int y = 0; y < height_; ++y) {
          for (int x = 0; x < width_; ++x) {
            sheet.channels[c][std::size_t(top + y) * std::size_t(sheet.width) + std::size_t(left + x)] =
                float(exposures[r] * copy.channels[c][std::size_t(y) * std::size_t(width_) + std::size_t(x)]);
          }
        }
      }
      draw_label(sheet, left, top, copy.label);
      left += width_ + kGap;
    }
  }
  const PictureView view{
      sheet.width, sheet.height, {sheet.channels[0].data(), sheet.channels[1].data(), sheet.channels[2].data()}};
  return write_display_png(path, view, 1);
}

}  // namespace helio::cli
