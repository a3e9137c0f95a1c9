#include "renderer/scene/mitsuba/spectrum.h"

#include <algorithm>
#include <cmath>

#include "renderer/scene/images/cie_1931.h"

namespace helio::mitsuba {

namespace {

// XYZ to linear sRGB (IEC 61966-2-1).
V3d to_srgb(const V3d& c) {
  return {3.240479 * c.x - 1.537150 * c.y - 0.498535 * c.z, -0.969256 * c.x + 1.875991 * c.y + 0.041556 * c.z,
          0.055648 * c.x - 0.204043 * c.y + 1.057311 * c.z};
}

}  // namespace

std::optional<Rgb> spectrum_color(const std::string& text, SpectrumUse use) {
  std::string plain = text;
  std::replace(plain.begin(), plain.end(), ':', ' ');
  const auto numbers = parse_numbers(plain);
  if (!numbers || numbers->empty() || numbers->size() % 2 != 0) return std::nullopt;
  const std::vector<double>& v = *numbers;
  for (std::size_t i = 0; i < v.size(); i += 2)
    if ((i > 0 && v[i] <= v[i - 2]) || v[i + 1] < 0) return std::nullopt;

  const auto value_at = [&](double nm) {
    if (nm < v[0] || nm > v[v.size() - 2]) return 0.0;
    for (std::size_t i = 2; i < v.size(); i += 2)
      if (nm <= v[i]) return v[i - 1] + (v[i + 1] - v[i - 1]) * (nm - v[i - 2]) / (v[i] - v[i - 2]);
    return v[1];
  };
  V3d sum(0, 0, 0), white(0, 0, 0);
  for (double nm = kCieFirst + 0.5; nm < kCieLast; nm += 1) {
    const V3d response = cie_1931_observer(nm) * (use == SpectrumUse::emission ? 1.0 : cie_d65(nm));
    sum += response * value_at(nm);
    white += response;
  }
  const V3d color = to_srgb(sum / white.y), unit = to_srgb(white / white.y);
  Rgb out;
  for (int c = 0; c < 3; ++c) {
    const double relative = use == SpectrumUse::emission ? color[c] : color[c] / unit[c];
    out[c] = float(std::clamp(relative, 0.0, use == SpectrumUse::reflectance ? 1.0 : 1e30));
  }
  return out;
}

Rgb equal_energy_white() {
  static const Rgb white = *spectrum_color("360:1, 830:1", SpectrumUse::emission);
  return white;
}

}  // namespace helio::mitsuba
