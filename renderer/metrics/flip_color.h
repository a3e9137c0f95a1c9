// The colour spaces of FLIP: linear sRGB, XYZ in units of white, CIELAB with the Hunt effect (Andersson et al. 2020,
// "FLIP: A Difference Evaluator for Alternating Images", colour pipeline: perceptually uniform colour space).
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace helio {

// XYZ over that of white, from linear sRGB: the matrix of the sRGB primaries and D65 at (0.31271, 0.32902), each row
// divided by its sum.
inline constexpr float kWhiteXFromRgb[3] = {0.433895389f, 0.376242373f, 0.189862239f};
inline constexpr float kWhiteYFromRgb[3] = {0.212636822f, 0.715182982f, 0.072180196f};
inline constexpr float kWhiteZFromRgb[3] = {0.017752423f, 0.109465629f, 0.872781948f};
// The inverse.
inline constexpr float kRgbFromWhite[3][3] = {{3.080341988f, -1.537398969f, -0.542943019f},
                                              {-0.921178396f, 1.875929984f, 0.045248412f},
                                              {0.052881293f, -0.204011206f, 1.151129913f}};

// [0, 1].
inline float clamp_to_display(float value) {
  const float positive = value > 0 ? value : 0;
  return positive < 1 ? positive : 1;
}

struct HuntLab {
  float l = 0, a = 0, b = 0;
};

// Cube root of x in [1e-30, 1e30], relative error below 3e-7: a guess from the exponent, and two steps of Halley's.
inline float cube_root(float x) {
  const auto better = [x](float root) {
    const float cube = root * root * root;
    return root * (cube + 2 * x) / (2 * cube + x);
  };
  return better(better(std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) / 3 + 0x2a510000u)));
}

// The curve of CIELAB less its value at 0, without which lightness near black would be a small difference of large
// numbers.
inline float lab_curve(float t) {
  constexpr float kDelta = 6.0f / 29.0f, kStart = kDelta * kDelta * kDelta;
  const float root = cube_root(t > kStart ? t : kStart) - 4.0f / 29.0f;
  const float line = t / (3 * kDelta * kDelta);
  return t > kStart ? root : line;
}

// L*, and a* and b* times 0.01 L* (the Hunt effect), of XYZ over that of white.
inline HuntLab hunt_lab(float white_x, float white_y, float white_z) {
  const float x = lab_curve(white_x), y = lab_curve(white_y), z = lab_curve(white_z);
  const float l = 116 * y;
  return {l, 0.01f * l * 500 * (x - y), 0.01f * l * 200 * (y - z)};
}

// The same of a colour that may lie slightly out of the range of the display, and is clamped to it. Colours in range
// are not converted to RGB and back: that would cost digits that small differences need.
inline HuntLab clamped_hunt_lab(float white_x, float white_y, float white_z) {
  const float(&m)[3][3] = kRgbFromWhite;
  const float r = m[0][0] * white_x + m[0][1] * white_y + m[0][2] * white_z;
  const float g = m[1][0] * white_x + m[1][1] * white_y + m[1][2] * white_z;
  const float b = m[2][0] * white_x + m[2][1] * white_y + m[2][2] * white_z;
  const float dr = clamp_to_display(r) - r, dg = clamp_to_display(g) - g, db = clamp_to_display(b) - b;
  return hunt_lab(white_x + kWhiteXFromRgb[0] * dr + kWhiteXFromRgb[1] * dg + kWhiteXFromRgb[2] * db,
                  white_y + kWhiteYFromRgb[0] * dr + kWhiteYFromRgb[1] * dg + kWhiteYFromRgb[2] * db,
                  white_z + kWhiteZFromRgb[0] * dr + kWhiteZFromRgb[1] * dg + kWhiteZFromRgb[2] * db);
}

// Distance in lightness and colour, one added to the other (HyAB; Andersson et al. 2020, colour pipeline: colour
// metric).
inline float hyab_distance(const HuntLab& p, const HuntLab& q) {
  const float a = p.a - q.a, b = p.b - q.b;
  return std::abs(p.l - q.l) + std::sqrt(a * a + b * b);
}

}  // namespace helio
